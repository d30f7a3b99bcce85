# SPDX-License-Identifier: Apache-2.0
find_package(CLI11 REQUIRED)
gsc_add_test(test_tool SOURCES tool/test_command_words.cpp tool/test_completion.cpp tool/test_options.cpp tool/test_reporter.cpp
             LIBS gsc_cli CLI11::CLI11)

# what users see of completion and manual pages: the shells and man are run, those that are not there are skipped
if(TARGET gsc-play)
  set(programs $<TARGET_FILE:gsc-play>)
  if(TARGET gsc)
    list(PREPEND programs $<TARGET_FILE:gsc>)
  endif()
  foreach(name shells man)
    add_test(NAME test_${name} COMMAND ${Python3_EXECUTABLE} ${CMAKE_CURRENT_SOURCE_DIR}/tool/test_${name}.py ${programs})
    set_tests_properties(test_${name} PROPERTIES LABELS "cpu;slow" TIMEOUT 600)
  endforeach()
endif()
