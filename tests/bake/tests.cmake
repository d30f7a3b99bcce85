# SPDX-License-Identifier: Apache-2.0
if(TARGET gsc_bake)
  set(bake_model bake/memory_model.cpp)
  gsc_add_test(test_bake_parts SOURCES bake/test_grid_fit.cpp bake/test_morton.cpp bake/test_mlp_pack.cpp ${bake_model}
    LIBS gsc_bake gsc_compare gsc_grids)
  gsc_add_test(test_bake SOURCES bake/test_bake.cpp bake/test_bake_errors.cpp bake/test_compare.cpp
    bake/test_sensitivity.cpp ${bake_model} LIBS gsc_bake gsc_compare gsc_grids gsc_kernels)
  gsc_add_test(test_lpips_weights SOURCES bake/test_lpips_weights.cpp LIBS gsc_compare gsc_input_fixture)
  # the module's own, which are not known here
  list(APPEND CMAKE_MODULE_PATH ${GSC_OPENVDB_MODULE_DIR})
  find_package(OpenVDB REQUIRED)
  gsc_add_test(test_grids SOURCES bake/test_nanovdb.cpp bake/test_locate.cpp bake/test_grid_files.cpp ${bake_model}
    LIBS gsc_bake gsc_grids OpenVDB::openvdb TBB::tbb)
  target_include_directories(test_grids SYSTEM PRIVATE ${GSC_NANOVDB_INCLUDE_DIR})
  gsc_add_test(test_bake_trained SOURCES bake/test_trained_models.cpp ${bake_model} LIBS gsc_bake gsc_compare gsc_grids gsc_kernels)
  if(GSC_SANITIZE) # minutes, of what test_bake and test_trained_models run too
    set_tests_properties(test_bake_trained PROPERTIES LABELS "cpu;slow")
  endif()
endif()
