# SPDX-License-Identifier: Apache-2.0
if(TARGET gsc_sample)
  find_package(TBB REQUIRED)
  add_library(gsc_sample_tools STATIC sample/sample_tools.cpp)
  target_include_directories(gsc_sample_tools PUBLIC ${CMAKE_CURRENT_SOURCE_DIR})
  target_link_libraries(gsc_sample_tools PUBLIC gsc_sample gsc_format gsc_build_flags)

  gsc_add_test(test_sample SOURCES sample/test_sample.cpp sample/test_sample_weights.cpp
               LIBS gsc_sample_tools gsc_write gsc_input TBB::tbb)
  gsc_add_test(test_sample_folder SOURCES sample/test_sample_folder.cpp LIBS gsc_sample_tools)
  gsc_add_test(test_replicate SOURCES sample/test_replicate.cpp LIBS gsc_sample_tools gsc_write gsc_input gsc_cameras)
  gsc_add_test(test_site_paths SOURCES sample/test_site_paths.cpp
               LIBS gsc_sample_tools gsc_write gsc_input gsc_cameras)
  gsc_add_test(test_model_paths SOURCES sample/test_model_paths.cpp TIMEOUT 1200
               LIBS gsc_sample_tools gsc_write gsc_input gsc_cameras)
  if(GSC_SANITIZE) # five minutes, of what test_site_paths runs too
    set_tests_properties(test_model_paths PROPERTIES LABELS "cpu;slow")
  endif()
endif()
