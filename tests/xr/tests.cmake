# SPDX-License-Identifier: Apache-2.0
if(TARGET gsc_player)
  gsc_add_test(test_placement SOURCES xr/test_placement.cpp xr/test_hands.cpp xr/test_late_eyes.cpp
                                      xr/test_lens_mask.cpp xr/test_start.cpp LIBS gsc_player glm::glm)
endif()
add_subdirectory(xr/fake)
if(TARGET gsc_headset AND TARGET gsc_fake_xr AND TARGET gsc)
  add_executable(write_depths xr/write_depths.cpp)
  target_link_libraries(write_depths PRIVATE gsc_player gsc_build_flags)
  # beside the manifest, where test_xr looks for it
  set_target_properties(write_depths PROPERTIES RUNTIME_OUTPUT_DIRECTORY $<TARGET_FILE_DIR:gsc_fake_xr>)
  set(sessions controllers states losses refusals)
  foreach(part XrTest XrPaceTest XrStartTest)
    string(REPLACE XrTest test_xr name ${part})
    string(REPLACE XrPaceTest test_xr_pace name ${name})
    string(REPLACE XrStartTest test_xr_start name ${name})
    add_test(NAME ${name}
             COMMAND ${GSC_SYSTEM_PYTHON} ${CMAKE_CURRENT_SOURCE_DIR}/xr/test_xr.py ${PROJECT_SOURCE_DIR}
                     $<TARGET_FILE:gsc-play> $<TARGET_FILE:gsc> $<TARGET_FILE_DIR:gsc_fake_xr>/gsc_fake_xr.json ${part})
    set_tests_properties(${name} PROPERTIES LABELS cpu TIMEOUT 1200 SKIP_RETURN_CODE 77 PROCESSORS 2)
  endforeach()
  if(GSC_SANITIZE) # all of them take minutes there: a few go through every file of the session
    set_tests_properties(test_xr test_xr_start PROPERTIES LABELS "cpu;slow")
    list(TRANSFORM sessions PREPEND XrTest.test_ OUTPUT_VARIABLE some_sessions)
    add_test(NAME test_xr_some
             COMMAND ${GSC_SYSTEM_PYTHON} ${CMAKE_CURRENT_SOURCE_DIR}/xr/test_xr.py ${PROJECT_SOURCE_DIR}
                     $<TARGET_FILE:gsc-play> $<TARGET_FILE:gsc> $<TARGET_FILE_DIR:gsc_fake_xr>/gsc_fake_xr.json
                     ${some_sessions})
    set_tests_properties(test_xr_some PROPERTIES LABELS cpu TIMEOUT 600 SKIP_RETURN_CODE 77 PROCESSORS 2)
  endif()
  set(fake_headset $<TARGET_FILE_DIR:gsc_fake_xr>/gsc_fake_xr.json)
  # a minute of refreshes on time: with nothing beside it, and not under a sanitizer
  set_tests_properties(test_xr_pace PROPERTIES LABELS "cpu;slow" RUN_SERIAL ON)
endif()
if(TARGET gsc-play AND TARGET gsc)
  # window and headset hold to one metre with the rest, where there are these
  add_test(NAME test_metre
           COMMAND ${GSC_SYSTEM_PYTHON} ${CMAKE_CURRENT_SOURCE_DIR}/player/test_metre.py ${PROJECT_SOURCE_DIR}
                   $<TARGET_FILE:gsc-play> $<TARGET_FILE:gsc> ${fake_headset})
  set_tests_properties(test_metre PROPERTIES LABELS cpu TIMEOUT 600 PROCESSORS 2)
endif()
