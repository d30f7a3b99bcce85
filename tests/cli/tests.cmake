# SPDX-License-Identifier: Apache-2.0
if(TARGET gsc_commands)
  gsc_add_test(commands_test SOURCES cli/test_commands.cpp LIBS gsc_commands)

  # the distribution's Python has jsonschema, where another one stands before it in PATH
  find_program(GSC_SYSTEM_PYTHON python3 PATHS /usr/bin NO_DEFAULT_PATH DOC "a Python with jsonschema and numpy")
  if(NOT GSC_SYSTEM_PYTHON)
    set(GSC_SYSTEM_PYTHON ${Python3_EXECUTABLE})
  endif()
  set(cli_dir ${CMAKE_CURRENT_SOURCE_DIR}/cli)
  get_target_property(has_figures gsc_chart GSC_HAS_FIGURES)
  if(has_figures)
    set(chart_figures chart_figures)
  else()
    set(chart_figures chart_no_figures)
  endif()
  if(TARGET gsc-play)
    set(play --play $<TARGET_FILE:gsc-play>)
  endif()
  if(GSC_HAVE_ZSTD)
    set(archive archive)
    set(bake bake) # which says what an archive would take
    set(export_spz4 export_spz4)
  endif()
  if(GSC_HAVE_WEBP)
    set(export_sog export_sog)
  endif()
  foreach(suite general validate info ${archive} ${bake} export ${export_sog} ${export_spz4} convert refused compare compare_pictures compare_render sample chart ${chart_figures} outputs interrupt killed)
    add_test(NAME cli_${suite}
             COMMAND ${GSC_SYSTEM_PYTHON} ${cli_dir}/run_cli_case.py --gsc $<TARGET_FILE:gsc> ${play} --source ${PROJECT_SOURCE_DIR}
                     --work ${CMAKE_CURRENT_BINARY_DIR}/cli_${suite} ${cli_dir}/cases/${suite}.json)
    set_tests_properties(cli_${suite} PROPERTIES LABELS cpu TIMEOUT 600)
  endforeach()
  # a table of command lines each; a minute and a half on two quiet cores, and many times that under a sanitizer
  if(TARGET gsc-play)
    foreach(table convert play inputs)
      add_test(NAME cli_table_${table}
               COMMAND ${GSC_SYSTEM_PYTHON} ${cli_dir}/run_table.py --gsc $<TARGET_FILE:gsc> --play $<TARGET_FILE:gsc-play>
                       --source ${PROJECT_SOURCE_DIR} --work ${CMAKE_CURRENT_BINARY_DIR}/cli_table_${table}
                       ${cli_dir}/tables/${table}.txt)
      set_tests_properties(cli_table_${table} PROPERTIES LABELS "cpu;slow" TIMEOUT 1200)
    endforeach()
    add_test(NAME check_options COMMAND ${GSC_SYSTEM_PYTHON} ${CMAKE_CURRENT_SOURCE_DIR}/check_options.py $<TARGET_FILE:gsc>
                                        $<TARGET_FILE:gsc-play>)
    set_tests_properties(check_options PROPERTIES LABELS cpu TIMEOUT 60)
  endif()
  # few threads and little memory, as a container has them
  if(TARGET gsc-play AND GSC_HAVE_ZSTD AND GSC_HAVE_WEBP AND NOT GSC_SANITIZE)
    set(programs $<TARGET_FILE:gsc> $<TARGET_FILE:gsc-play>)
    foreach(runs 40 400)
      add_test(NAME test_few_threads_${runs} COMMAND ${GSC_SYSTEM_PYTHON} ${cli_dir}/test_few_threads.py ${programs}
                                                     ${CMAKE_CURRENT_BINARY_DIR}/few_threads_${runs} ${runs})
    endforeach()
    add_test(NAME test_memory_limit COMMAND ${GSC_SYSTEM_PYTHON} ${cli_dir}/test_memory_limit.py ${programs}
                                            ${CMAKE_CURRENT_BINARY_DIR}/memory_limit)
    add_test(NAME test_memory_limit_trained
             COMMAND ${GSC_SYSTEM_PYTHON} ${cli_dir}/test_memory_limit.py ${programs}
                     ${CMAKE_CURRENT_BINARY_DIR}/memory_limit_trained ${PROJECT_SOURCE_DIR}/../shared/checkpoints)
    set_tests_properties(test_few_threads_40 PROPERTIES LABELS cpu TIMEOUT 300 SKIP_RETURN_CODE 77)
    set_tests_properties(test_memory_limit PROPERTIES LABELS "cpu;slow" TIMEOUT 600 SKIP_RETURN_CODE 77)
    set_tests_properties(test_few_threads_400 test_memory_limit_trained PROPERTIES LABELS "cpu;slow;long" TIMEOUT 1800
                                                                                   SKIP_RETURN_CODE 77)
  endif()
  set_tests_properties(cli_${chart_figures} PROPERTIES ENVIRONMENT "${chart_environment}")
  # minutes under a sanitizer, and what they add is not about memory
  foreach(suite ${bake} export ${export_sog} compare_pictures compare_render interrupt killed)
    set_tests_properties(cli_${suite} PROPERTIES LABELS "cpu;slow")
  endforeach()
endif()

foreach(check check_traps check_openers check_includes check_cases check_schemas)
  add_test(NAME ${check} COMMAND ${Python3_EXECUTABLE} ${CMAKE_CURRENT_SOURCE_DIR}/${check}.py)
  set_tests_properties(${check} PROPERTIES LABELS cpu TIMEOUT 60)
endforeach()

if(GSC_CI_TESTS)
  include(${PROJECT_SOURCE_DIR}/.ci/tests.cmake)
endif()
