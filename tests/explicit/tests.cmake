# SPDX-License-Identifier: Apache-2.0
if(TARGET gsc_explicit)
  find_package(nlohmann_json REQUIRED)
  gsc_add_test(test_explicit SOURCES explicit/test_explicit.cpp
               LIBS gsc_explicit gsc_test_synthetic gsc_runtime gsc_metrics gsc_format nlohmann_json::nlohmann_json)
  target_compile_definitions(test_explicit PRIVATE GSC_HAVE_WEBP=${GSC_HAVE_WEBP} GSC_HAVE_ZSTD=${GSC_HAVE_ZSTD})
endif()
if(TARGET gsc_viewer)
  gsc_add_test(test_viewer_page SOURCES explicit/test_viewer_page.cpp LIBS gsc_viewer)
endif()
