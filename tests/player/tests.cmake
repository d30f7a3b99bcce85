# SPDX-License-Identifier: Apache-2.0
find_package(nlohmann_json 3.11 REQUIRED)

gsc_add_test(test_camera_file
             SOURCES player/test_camera_contradictions.cpp player/test_camera_file.cpp player/test_camera_lens.cpp
                     player/test_colmap_cameras.cpp player/test_colmap_variants.cpp player/test_trainer_size.cpp
             LIBS gsc_cameras nlohmann_json::nlohmann_json)
gsc_add_test(test_image_io SOURCES player/test_image_io.cpp LIBS gsc_image)
if(TARGET gsc_player)
  find_package(CLI11 REQUIRED)
  gsc_add_test(test_out_pattern SOURCES player/test_out_pattern.cpp LIBS gsc_player)
  gsc_add_test(test_play_options SOURCES player/test_play_options.cpp LIBS gsc_player gsc_test_tiny CLI11::CLI11)
  gsc_add_test(test_navigation SOURCES player/test_navigation.cpp LIBS gsc_player glm::glm)
  gsc_add_test(test_rest_pictures SOURCES player/test_rest_pictures.cpp player/test_panel.cpp LIBS gsc_player)
  gsc_add_test(test_made_cameras SOURCES player/test_made_cameras.cpp LIBS gsc_player gsc_test_tiny glm::glm)
  gsc_add_test(test_path_recorder SOURCES player/test_path_recorder.cpp LIBS gsc_player glm::glm)
  gsc_add_test(test_roofline SOURCES player/test_roofline.cpp LIBS gsc_player)
  gsc_add_test(test_accuracy SOURCES player/test_scorer.cpp player/test_fovea.cpp
               LIBS gsc_player nlohmann_json::nlohmann_json)
  gsc_add_test(test_sweep_config SOURCES player/test_sweep_config.cpp LIBS gsc_player nlohmann_json::nlohmann_json)
  gsc_add_test(test_shard SOURCES player/test_shard.cpp LIBS gsc_player nlohmann_json::nlohmann_json)
  gsc_add_test(test_runner SOURCES player/test_runner.cpp LIBS gsc_player)
  gsc_add_test(test_run_rows SOURCES player/test_run_rows.cpp LIBS gsc_player nlohmann_json::nlohmann_json)

  add_executable(write_bench_report player/write_bench_report.cpp)
  target_link_libraries(write_bench_report PRIVATE gsc_player gsc_build_flags)
  add_executable(write_tiny_gsc player/write_tiny_gsc.cpp)
  target_link_libraries(write_tiny_gsc PRIVATE gsc_test_tiny gsc_build_flags)
  # the distribution's Python has jsonschema and numpy, where another one stands before it in PATH
  find_program(GSC_SYSTEM_PYTHON python3 PATHS /usr/bin NO_DEFAULT_PATH DOC "a Python with jsonschema and numpy")
  if(NOT GSC_SYSTEM_PYTHON)
    set(GSC_SYSTEM_PYTHON ${Python3_EXECUTABLE})
  endif()
  foreach(cli test_play_cli test_play_outputs test_own_pictures test_bench_cli)
    add_test(NAME ${cli}
             COMMAND ${GSC_SYSTEM_PYTHON} ${CMAKE_CURRENT_SOURCE_DIR}/player/${cli}.py ${PROJECT_SOURCE_DIR}
                     $<TARGET_FILE:gsc-play> $<TARGET_FILE:write_tiny_gsc> $<TARGET_FILE:write_bench_report>)
  endforeach()
  add_test(NAME test_workers_cli COMMAND ${GSC_SYSTEM_PYTHON} ${CMAKE_CURRENT_SOURCE_DIR}/player/test_workers_cli.py
                                         ${PROJECT_SOURCE_DIR} $<TARGET_FILE:gsc-play> $<TARGET_FILE:write_tiny_gsc>)
  set_tests_properties(test_workers_cli PROPERTIES LABELS cpu TIMEOUT 600)
  if(TARGET gsc-play-mpi)
    add_test(NAME test_mpi_cli
             COMMAND ${GSC_SYSTEM_PYTHON} ${CMAKE_CURRENT_SOURCE_DIR}/player/test_mpi_cli.py ${MPIEXEC_EXECUTABLE}
                     $<TARGET_FILE:gsc-play> $<TARGET_FILE:gsc-play-mpi> $<TARGET_FILE:write_tiny_gsc>)
    set_tests_properties(test_mpi_cli PROPERTIES LABELS cpu TIMEOUT 600 PROCESSORS 2)
  endif()
  add_test(NAME test_sweep_cli COMMAND ${GSC_SYSTEM_PYTHON} ${CMAKE_CURRENT_SOURCE_DIR}/player/test_sweep_cli.py
                                       ${PROJECT_SOURCE_DIR} $<TARGET_FILE:gsc-play> $<TARGET_FILE:write_tiny_gsc>)
  if(TARGET gsc)
    set(shards ${GSC_SYSTEM_PYTHON} ${CMAKE_CURRENT_SOURCE_DIR}/player/test_shards.py ${PROJECT_SOURCE_DIR}
               $<TARGET_FILE:gsc-play> $<TARGET_FILE:write_tiny_gsc> $<TARGET_FILE:gsc>)
    add_test(NAME test_shards COMMAND ${shards})
    set_tests_properties(test_shards PROPERTIES LABELS cpu TIMEOUT 600)
    add_test(NAME test_png COMMAND ${GSC_SYSTEM_PYTHON} ${CMAKE_CURRENT_SOURCE_DIR}/player/test_png.py ${PROJECT_SOURCE_DIR}
                                   $<TARGET_FILE:gsc-play> $<TARGET_FILE:write_tiny_gsc> $<TARGET_FILE:gsc>)
    set_tests_properties(test_png PROPERTIES LABELS cpu TIMEOUT 300)
    add_test(NAME test_play_models COMMAND ${GSC_SYSTEM_PYTHON} ${CMAKE_CURRENT_SOURCE_DIR}/player/test_play_models.py
                                              ${PROJECT_SOURCE_DIR} $<TARGET_FILE:gsc-play> $<TARGET_FILE:gsc>)
    set_tests_properties(test_play_models PROPERTIES LABELS cpu TIMEOUT 300)
    add_test(NAME test_shards_parallel COMMAND ${shards} parallel)
    set_tests_properties(test_shards_parallel PROPERTIES LABELS "cpu;slow;long" TIMEOUT 1200)
    add_test(NAME test_paper COMMAND ${GSC_SYSTEM_PYTHON} ${CMAKE_CURRENT_SOURCE_DIR}/player/test_paper.py ${PROJECT_SOURCE_DIR}
                                     $<TARGET_FILE:gsc> $<TARGET_FILE:gsc-play>)
    set_tests_properties(test_paper PROPERTIES LABELS "cpu;slow" TIMEOUT 1200)
    add_test(NAME test_frontier COMMAND ${GSC_SYSTEM_PYTHON} ${CMAKE_CURRENT_SOURCE_DIR}/player/test_frontier.py
                                        ${PROJECT_SOURCE_DIR} $<TARGET_FILE:gsc> $<TARGET_FILE:gsc-play>)
    set_tests_properties(test_frontier PROPERTIES LABELS "cpu;slow" TIMEOUT 600)
  endif()
  if(TARGET gsc)
    add_test(NAME test_without_proc COMMAND ${GSC_SYSTEM_PYTHON} ${CMAKE_CURRENT_SOURCE_DIR}/package/test_without_proc.py
                                            $<TARGET_FILE:gsc> $<TARGET_FILE:gsc-play>)
    set_tests_properties(test_without_proc PROPERTIES LABELS cpu TIMEOUT 300)
  endif()
  add_test(NAME test_build_script COMMAND ${GSC_SYSTEM_PYTHON} ${CMAKE_CURRENT_SOURCE_DIR}/package/test_build_script.py
                                          ${PROJECT_SOURCE_DIR})
  add_test(NAME test_layers COMMAND ${GSC_SYSTEM_PYTHON} ${CMAKE_CURRENT_SOURCE_DIR}/package/check_package.py
                                    ${PROJECT_SOURCE_DIR} ${CMAKE_COMMAND} layers)
  if(TARGET gsc_present AND TARGET gsc)
    foreach(name test_window test_window_opening)
      add_test(NAME ${name} COMMAND ${GSC_SYSTEM_PYTHON} ${CMAKE_CURRENT_SOURCE_DIR}/player/${name}.py
                                    ${PROJECT_SOURCE_DIR} $<TARGET_FILE:gsc-play> $<TARGET_FILE:gsc>)
      set_tests_properties(${name} PROPERTIES LABELS cpu TIMEOUT 1200 SKIP_RETURN_CODE 77 PROCESSORS 2)
    endforeach()
  endif()
  set_tests_properties(test_play_cli test_play_outputs test_bench_cli test_sweep_cli test_layers test_build_script PROPERTIES LABELS cpu TIMEOUT 300)
  # under a sanitizer a start takes more memory
  add_test(NAME test_installed
           COMMAND ${GSC_SYSTEM_PYTHON} ${CMAKE_CURRENT_SOURCE_DIR}/package/check_package.py ${PROJECT_SOURCE_DIR}
                   ${CMAKE_COMMAND} installed ${PROJECT_BINARY_DIR} $<TARGET_FILE:write_tiny_gsc>)
  set_tests_properties(test_installed PROPERTIES LABELS "cpu;slow" TIMEOUT 600)
endif()

# against the trainers' own renders and dumps
if(TARGET gsc_write AND GSC_BUILD_PLAYER)
  gsc_add_test(
    test_golden
    SOURCES player/test_golden.cpp
    LIBS gsc_write gsc_image gsc_metrics gsc_runtime nlohmann_json::nlohmann_json
    LABELS cpu slow
    TIMEOUT 600)

  add_library(gsc_golden_city STATIC player/golden_city.cpp)
  target_link_libraries(gsc_golden_city PUBLIC gsc_write gsc_image gsc_metrics gsc_player gsc_runtime gsc_sample
                                        PRIVATE gsc_build_flags gsc_test_main)
  gsc_add_test(
    test_golden_cities
    SOURCES player/test_golden_cities.cpp
    LIBS gsc_golden_city
    LABELS cpu slow
    TIMEOUT 1200)
  if(GSC_HAVE_CUDA)
    # to be carried like test_cuda, but with the libraries of the bundle beside it: it makes and converts the cities itself
    add_executable(test_golden_cities_cuda player/test_golden_cities_cuda.cpp support/gpu_main.cpp)
    target_link_libraries(test_golden_cities_cuda PRIVATE gsc_golden_city gsc_build_flags gsc_test_main)
    target_link_options(test_golden_cities_cuda PRIVATE -Wl,--disable-new-dtags) # as gsc's in a bundle
    set_target_properties(test_golden_cities_cuda PROPERTIES BUILD_RPATH "$ORIGIN")
    add_test(NAME test_golden_cities_cuda COMMAND test_golden_cities_cuda)
    set_tests_properties(test_golden_cities_cuda PROPERTIES LABELS "gpu;long" TIMEOUT 3600 SKIP_RETURN_CODE 77
                                                            SKIP_REGULAR_EXPRESSION "skipped: no trained models")
  endif()

  add_executable(dump_intermediates player/dump_intermediates.cpp)
  target_link_libraries(dump_intermediates PRIVATE gsc_write gsc_cameras gsc_runtime gsc_kernels
                                                   nlohmann_json::nlohmann_json gsc_build_flags)
  execute_process(COMMAND ${GSC_SYSTEM_PYTHON} -c "import numpy" RESULT_VARIABLE gsc_no_numpy OUTPUT_QUIET ERROR_QUIET)
  if(gsc_no_numpy)
    message(STATUS "no numpy: test_intermediates is left out")
  else()
    add_test(NAME test_intermediates
             COMMAND ${GSC_SYSTEM_PYTHON} ${CMAKE_CURRENT_SOURCE_DIR}/player/check_intermediates.py
                     $<TARGET_FILE:dump_intermediates> ${PROJECT_SOURCE_DIR}/../shared/checkpoints)
    set_tests_properties(test_intermediates PROPERTIES LABELS "cpu;slow" TIMEOUT 300)
  endif()
endif()
