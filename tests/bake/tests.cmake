# SPDX-License-Identifier: Apache-2.0
if(TARGET gsc_bake AND TARGET gsc_sample_tools)
  gsc_add_test(test_bake SOURCES bake/test_bake.cpp bake/test_tiles.cpp bake/test_foreign_files.cpp
                       bake/test_bake_memory.cpp bake/test_bake_state.cpp bake/test_resume.cpp
               LIBS gsc_bake gsc_write gsc_cameras gsc_runtime gsc_sample_tools gsc_test_tiny)
  if(GSC_SANITIZE) # some bakes of many pictures each
    set_tests_properties(test_bake PROPERTIES LABELS "cpu;slow")
  endif()
endif()
