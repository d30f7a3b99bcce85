# SPDX-License-Identifier: Apache-2.0
# Completions for shells and a manual page for every command of a program, printed by the program itself.
# As a script, cmake -DPROGRAM=FILE -DNAME=NAME -DOUT=FOLDER -P shell_files.cmake, this file writes them.
if(CMAKE_SCRIPT_MODE_FILE)
  function(print file)
    execute_process(COMMAND ${PROGRAM} ${ARGN} OUTPUT_FILE ${OUT}/${file} COMMAND_ERROR_IS_FATAL ANY)
  endfunction()

  # The pages of the command that the words behind it name, and of all below it.
  function(print_pages)
    list(JOIN ARGN "-" page)
    list(POP_FRONT ARGN)
    print(man/man1/${page}.1 man ${ARGN})
    execute_process(COMMAND ${PROGRAM} __complete man ${ARGN} "" OUTPUT_VARIABLE lines COMMAND_ERROR_IS_FATAL ANY)
    string(REGEX MATCHALL "[^\n]+" lines "${lines}")
    foreach(line IN LISTS lines)
      string(REGEX REPLACE "\t.*" "" command "${line}")
      print_pages(${NAME} ${ARGN} ${command})
    endforeach()
  endfunction()

  file(REMOVE_RECURSE ${OUT})
  file(MAKE_DIRECTORY ${OUT}/bash-completion/completions ${OUT}/zsh/site-functions ${OUT}/fish/vendor_completions.d
       ${OUT}/man/man1)
  print(bash-completion/completions/${NAME} completion bash)
  print(zsh/site-functions/_${NAME} completion zsh)
  print(fish/vendor_completions.d/${NAME}.fish completion fish)
  print_pages(${NAME})
  return()
endif()

# They are made anew when the program has changed, and installed with it.
function(gsc_add_shell_files program)
  if(CMAKE_CROSSCOMPILING) # the program may not run here
    return()
  endif()
  set(out ${PROJECT_BINARY_DIR}/shell/${program})
  set(script ${PROJECT_SOURCE_DIR}/runtime/cli/shell_files.cmake)
  add_custom_command(
    OUTPUT ${out}.stamp
    COMMAND ${CMAKE_COMMAND} -DPROGRAM=$<TARGET_FILE:${program}> -DNAME=${program} -DOUT=${out} -P ${script}
    COMMAND ${CMAKE_COMMAND} -E touch ${out}.stamp
    DEPENDS ${program} ${script}
    COMMENT "Completions and manual pages of ${program}"
    VERBATIM)
  add_custom_target(${program}_shell_files ALL DEPENDS ${out}.stamp)
  install(DIRECTORY ${out}/bash-completion ${out}/zsh ${out}/fish DESTINATION ${CMAKE_INSTALL_DATADIR} OPTIONAL)
  install(DIRECTORY ${out}/man/man1 DESTINATION ${CMAKE_INSTALL_MANDIR} OPTIONAL)
endfunction()
