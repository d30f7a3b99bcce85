# SPDX-License-Identifier: Apache-2.0
if(TARGET gsc_write)
  set(write_model write/memory_model.cpp)
  gsc_add_test(test_write_parts SOURCES write/test_grid_fit.cpp write/test_morton.cpp write/test_mlp_pack.cpp ${write_model}
    LIBS gsc_write gsc_compare gsc_grids)
  gsc_add_test(test_write SOURCES write/test_write.cpp write/test_write_errors.cpp write/test_compare.cpp
    write/test_sensitivity.cpp ${write_model} LIBS gsc_write gsc_compare gsc_grids gsc_kernels)
  gsc_add_test(test_lpips_weights SOURCES write/test_lpips_weights.cpp LIBS gsc_compare gsc_input_fixture)
  # the module's own, which are not known here
  list(APPEND CMAKE_MODULE_PATH ${GSC_OPENVDB_MODULE_DIR})
  find_package(OpenVDB REQUIRED)
  gsc_add_test(test_grids SOURCES write/test_nanovdb.cpp write/test_locate.cpp write/test_grid_files.cpp ${write_model}
    LIBS gsc_write gsc_grids OpenVDB::openvdb TBB::tbb)
  target_include_directories(test_grids SYSTEM PRIVATE ${GSC_NANOVDB_INCLUDE_DIR})
  gsc_add_test(test_write_trained SOURCES write/test_trained_models.cpp ${write_model} LIBS gsc_write gsc_compare gsc_grids gsc_kernels)
  if(GSC_SANITIZE) # minutes, of what test_write and test_trained_models run too
    set_tests_properties(test_write_trained PROPERTIES LABELS "cpu;slow")
  endif()
endif()
