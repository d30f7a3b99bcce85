# SPDX-License-Identifier: Apache-2.0
# Target `bundle`: a folder with gsc, gsc-play, their modules and every shared library they need but glibc's, to be
# carried to a machine that has nothing else; beside them completions/ and man/.
set(bundle_dir ${PROJECT_BINARY_DIR}/bundle)

get_property(modules GLOBAL PROPERTY GSC_MODULES)
# note: libraries of libraries are searched for beside the program only by DT_RPATH, not by the newer DT_RUNPATH
foreach(part gsc gsc-play ${modules})
  target_link_options(${part} PRIVATE -Wl,--disable-new-dtags)
  set_target_properties(${part} PROPERTIES INSTALL_RPATH "$ORIGIN")
endforeach()

install(TARGETS gsc gsc-play ${modules} RUNTIME_DEPENDENCY_SET gsc_bundle
        RUNTIME DESTINATION . COMPONENT bundle EXCLUDE_FROM_ALL
        LIBRARY DESTINATION . COMPONENT bundle EXCLUDE_FROM_ALL)
# gsc's C++ runtime comes along as a library, because OpenVDB shares it with gsc
install(RUNTIME_DEPENDENCY_SET gsc_bundle
        PRE_EXCLUDE_REGEXES "^(ld-linux.*|lib(c|m|dl|rt|pthread))[.]so"
        LIBRARY DESTINATION . COMPONENT bundle EXCLUDE_FROM_ALL)

if(NOT CMAKE_CROSSCOMPILING)
  set(shell_files gsc_shell_files gsc-play_shell_files)
  foreach(out ${PROJECT_BINARY_DIR}/shell/gsc ${PROJECT_BINARY_DIR}/shell/gsc-play)
    install(DIRECTORY ${out}/man DESTINATION . COMPONENT bundle EXCLUDE_FROM_ALL)
    install(DIRECTORY ${out}/bash-completion/completions/ ${out}/zsh/site-functions/ ${out}/fish/vendor_completions.d/
            DESTINATION completions COMPONENT bundle EXCLUDE_FROM_ALL)
  endforeach()
endif()

add_custom_target(bundle
  COMMAND ${CMAKE_COMMAND} -E rm -rf ${bundle_dir}
  COMMAND ${CMAKE_COMMAND} --install ${PROJECT_BINARY_DIR} --component bundle --prefix ${bundle_dir} --strip
  DEPENDS gsc gsc-play ${modules} ${shell_files}
  VERBATIM)
