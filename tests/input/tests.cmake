# SPDX-License-Identifier: Apache-2.0
if(TARGET gsc_input)
  add_library(gsc_input_fixture STATIC input/model_fixture.cpp input/torch_files.cpp)
  target_link_libraries(gsc_input_fixture PUBLIC gsc_input gsc_build_flags)

  gsc_add_test(test_torch_archive SOURCES input/test_torch_archive.cpp input/test_torch_variants.cpp
               input/test_legacy_archive.cpp LIBS gsc_input_fixture gsc_metrics)
  gsc_add_test(test_ply_reader SOURCES input/test_ply_reader.cpp LIBS gsc_input_fixture)
  gsc_add_test(test_input_config SOURCES input/test_config.cpp input/test_yaml_config.cpp LIBS gsc_input_fixture)
  gsc_add_test(test_checkpoint SOURCES input/test_checkpoint.cpp input/test_checkpoint_files.cpp
               input/test_checkpoint_refusals.cpp input/test_as_left.cpp LIBS gsc_input_fixture)
  gsc_add_test(test_checkpoint_cameras SOURCES input/test_cameras.cpp LIBS gsc_input_fixture)
  gsc_add_test(test_trained_models SOURCES input/test_trained_models.cpp LIBS gsc_input_fixture)
endif()
