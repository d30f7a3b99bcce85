# SPDX-License-Identifier: Apache-2.0
# The checks of .ci/run as CTest tests, so that one summary covers all. They build other presets, each in its folder.
function(gsc_add_ci_test name timeout)
  add_test(NAME ${name} COMMAND ${PROJECT_SOURCE_DIR}/.ci/${name}.sh)
  # each uses every core by itself
  set_tests_properties(${name} PROPERTIES LABELS ci TIMEOUT ${timeout} RUN_SERIAL TRUE)
endfunction()

gsc_add_ci_test(check_format 120)
gsc_add_ci_test(check_sanitizers 3600)
gsc_add_ci_test(check_threads 1800)
gsc_add_ci_test(check_fuzz 1800)

# all programs once more, as others get them
add_test(NAME test_package
         COMMAND ${Python3_EXECUTABLE} ${PROJECT_SOURCE_DIR}/tests/package/check_package.py ${PROJECT_SOURCE_DIR}
                 ${CMAKE_COMMAND} portable)
set_tests_properties(test_package PROPERTIES LABELS ci TIMEOUT 1800 RUN_SERIAL TRUE SKIP_RETURN_CODE 77)
