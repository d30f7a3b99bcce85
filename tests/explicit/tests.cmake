# SPDX-License-Identifier: Apache-2.0
if(TARGET gsc_explicit)
  find_package(nlohmann_json REQUIRED)
  gsc_add_test(test_explicit SOURCES explicit/test_explicit.cpp
               LIBS gsc_explicit gsc_test_synthetic gsc_runtime gsc_metrics gsc_format nlohmann_json::nlohmann_json)
  gsc_add_test(test_explicit_lod SOURCES explicit/test_explicit_lod.cpp
               LIBS gsc_explicit gsc_test_synthetic gsc_format nlohmann_json::nlohmann_json)
  foreach(test test_explicit test_explicit_lod)
    target_compile_definitions(${test} PRIVATE GSC_HAVE_WEBP=${GSC_HAVE_WEBP} GSC_HAVE_ZSTD=${GSC_HAVE_ZSTD})
  endforeach()
endif()
if(TARGET gsc_viewer)
  gsc_add_test(test_viewer_page SOURCES explicit/test_viewer_page.cpp LIBS gsc_viewer)
endif()
