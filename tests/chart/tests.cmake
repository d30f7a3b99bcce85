# SPDX-License-Identifier: Apache-2.0
if(TARGET gsc_chart)
  gsc_add_test(test_chart
    SOURCES chart/run_lines.cpp chart/test_curves.cpp chart/test_run_lines.cpp chart/test_chart_model.cpp chart/test_chart_page.cpp
            chart/test_figures.cpp chart/test_traces.cpp chart/test_verdict.cpp
    LIBS gsc_chart)
  target_compile_definitions(test_chart PRIVATE GSC_SWEEPS="${PROJECT_SOURCE_DIR}/samples/sweeps")
  # under a sanitizer; cli_chart_figures has it too
  set(chart_environment "LSAN_OPTIONS=suppressions=${CMAKE_CURRENT_SOURCE_DIR}/chart/lsan.txt:print_suppressions=0")
  set_tests_properties(test_chart PROPERTIES ENVIRONMENT "${chart_environment}")
endif()
