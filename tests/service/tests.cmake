# SPDX-License-Identifier: Apache-2.0
gsc_add_test(test_service_books SOURCES service/test_service_books.cpp service/test_service_policy.cpp
                                LIBS gsc_runtime gsc_kernels)
gsc_add_test(test_service SOURCES service/test_service.cpp service/test_service_faults.cpp
                          LIBS gsc_test_on_cpu)
# random faults for half a minute; for ten minutes by hand (ctest -L long)
add_test(NAME test_service_soak COMMAND test_service "--test-case=random faults*")
set_tests_properties(test_service_soak PROPERTIES LABELS "cpu;slow" TIMEOUT 300 ENVIRONMENT GSC_SOAK_SECONDS=30)
add_test(NAME test_service_soak_long COMMAND test_service "--test-case=random faults*")
set_tests_properties(test_service_soak_long PROPERTIES LABELS "cpu;slow;long" TIMEOUT 900 ENVIRONMENT GSC_SOAK_SECONDS=600)

if(TARGET gsc_player)
  add_executable(write_service_trace service/write_service_trace.cpp)
  target_link_libraries(write_service_trace PRIVATE gsc_test_on_cpu gsc_player gsc_build_flags doctest::doctest)
  # what it shares with tests has checks
  target_compile_definitions(write_service_trace PRIVATE DOCTEST_CONFIG_DISABLE)
  target_compile_options(write_service_trace PRIVATE -Wno-unused-variable -Wno-unused-but-set-variable)
  find_program(GSC_SYSTEM_PYTHON python3 PATHS /usr/bin NO_DEFAULT_PATH DOC "a Python with jsonschema and numpy")
  if(NOT GSC_SYSTEM_PYTHON)
    set(GSC_SYSTEM_PYTHON ${Python3_EXECUTABLE})
  endif()
  if(TARGET gsc)
    set(trace_gsc $<TARGET_FILE:gsc>)
  endif()
  add_test(NAME test_trace_cli
           COMMAND ${GSC_SYSTEM_PYTHON} ${CMAKE_CURRENT_SOURCE_DIR}/service/test_trace_cli.py ${PROJECT_SOURCE_DIR}
                   $<TARGET_FILE:write_service_trace> ${trace_gsc})
  set_tests_properties(test_trace_cli PROPERTIES LABELS cpu TIMEOUT 300)
  gsc_add_test(test_service_trace SOURCES service/test_service_trace.cpp LIBS gsc_player)
endif()
