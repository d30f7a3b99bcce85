# SPDX-License-Identifier: Apache-2.0
# half a minute on two busy cores, twice that with all; skipped without Chromium or the packages of package.json
if(TARGET gsc_commands AND TARGET gsc-play)
  foreach(name test_viewers test_viewers_all)
    set(all "")
    if(name STREQUAL "test_viewers_all")
      set(all --all)
    endif()
    add_test(NAME ${name}
             COMMAND ${GSC_SYSTEM_PYTHON} ${CMAKE_CURRENT_SOURCE_DIR}/viewers/check_viewers.py --gsc $<TARGET_FILE:gsc>
                     --play $<TARGET_FILE:gsc-play> --work ${CMAKE_CURRENT_BINARY_DIR}/${name} ${all})
    set_tests_properties(${name} PROPERTIES LABELS "cpu;slow" TIMEOUT 600 SKIP_RETURN_CODE 77 PROCESSORS 2)
  endforeach()
  set_property(TEST test_viewers_all APPEND PROPERTY LABELS long)
endif()
