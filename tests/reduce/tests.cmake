# SPDX-License-Identifier: Apache-2.0
if(TARGET gsc_reduce AND TARGET gsc_sample_tools)
  gsc_add_test(test_reduce SOURCES reduce/test_reduce.cpp reduce/test_tiles.cpp reduce/test_foreign_files.cpp
                       reduce/test_bake_memory.cpp reduce/test_bake_state.cpp reduce/test_resume.cpp
               LIBS gsc_reduce gsc_write gsc_cameras gsc_runtime gsc_sample_tools gsc_test_tiny)
  if(GSC_SANITIZE) # some bakes of many pictures each
    set_tests_properties(test_reduce PROPERTIES LABELS "cpu;slow")
  endif()
endif()
