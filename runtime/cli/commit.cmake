# SPDX-License-Identifier: Apache-2.0
# Sets gsc_commit to the commit of the checkout, empty where the sources are no checkout of their own or git is missing.
# Configuring runs again when the commit changes, so that a report does not name an older one.
set(gsc_commit "")
find_package(Git QUIET)
if(GIT_FOUND)
  set(gsc_git ${GIT_EXECUTABLE} -C ${PROJECT_SOURCE_DIR} rev-parse)
  # the prefix is empty in the top folder only: inside another repository the commit would be that one's
  execute_process(COMMAND ${gsc_git} --short HEAD --show-prefix OUTPUT_VARIABLE gsc_head ERROR_QUIET
                  RESULT_VARIABLE gsc_no_head)
  if(NOT gsc_no_head AND gsc_head MATCHES "^\n?([0-9a-f]+)\n*$")
    set(gsc_commit ${CMAKE_MATCH_1})
    execute_process(COMMAND ${gsc_git} --git-path logs/HEAD OUTPUT_VARIABLE gsc_log ERROR_QUIET
                    OUTPUT_STRIP_TRAILING_WHITESPACE)
    get_filename_component(gsc_log "${gsc_log}" ABSOLUTE BASE_DIR ${PROJECT_SOURCE_DIR})
    if(EXISTS "${gsc_log}")
      set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS "${gsc_log}")
    endif()
  endif()
endif()
