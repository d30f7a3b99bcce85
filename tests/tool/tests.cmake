# SPDX-License-Identifier: Apache-2.0
find_package(CLI11 REQUIRED)
gsc_add_test(test_tool SOURCES tool/test_command_words.cpp tool/test_completion.cpp tool/test_options.cpp tool/test_reporter.cpp
             LIBS gsc_tool CLI11::CLI11)
