# SPDX-License-Identifier: Apache-2.0
if(TARGET gsc_export)
  find_package(nlohmann_json REQUIRED)
  gsc_add_test(test_export SOURCES export/test_export.cpp
               LIBS gsc_export gsc_test_synthetic gsc_runtime gsc_metrics gsc_format nlohmann_json::nlohmann_json)
  gsc_add_test(test_export_lod SOURCES export/test_export_lod.cpp
               LIBS gsc_export gsc_test_synthetic gsc_format nlohmann_json::nlohmann_json)
  foreach(test test_export test_export_lod)
    target_compile_definitions(${test} PRIVATE GSC_HAVE_WEBP=${GSC_HAVE_WEBP} GSC_HAVE_ZSTD=${GSC_HAVE_ZSTD})
  endforeach()
endif()
if(TARGET gsc_viewer)
  gsc_add_test(test_viewer_page SOURCES export/test_viewer_page.cpp LIBS gsc_viewer)
endif()
