# SPDX-License-Identifier: Apache-2.0
# The installed CMake package `gsc`: find_package(gsc) gives gsc::runtime.
include(CMakePackageConfigHelpers)

set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/gsc)

set(package_libraries kernels camera runtime)
if(GSC_HAVE_CUDA)
  list(APPEND package_libraries kernels_cuda)
endif()

# our warning flags are nothing that a user of the package needs
foreach(library kernels kernels_cuda)
  if(TARGET gsc_${library})
    get_target_property(kernels_interface gsc_${library} INTERFACE_LINK_LIBRARIES)
    list(REMOVE_ITEM kernels_interface $<LINK_ONLY:gsc_build_flags>)
    set_target_properties(gsc_${library} PROPERTIES INTERFACE_LINK_LIBRARIES "${kernels_interface}")
  endif()
endforeach()

foreach(library ${package_libraries})
  set_target_properties(gsc_${library} PROPERTIES EXPORT_NAME ${library})
endforeach()
list(TRANSFORM package_libraries PREPEND gsc_ OUTPUT_VARIABLE package_targets)
install(TARGETS ${package_targets} EXPORT gscTargets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(EXPORT gscTargets NAMESPACE gsc:: DESTINATION ${package_dir})

# the public interface: what lies elsewhere is no promise
install(DIRECTORY include/ ${PROJECT_SOURCE_DIR}/kernels/include/ DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})

configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/cmake/gscConfig.cmake.in
                              ${CMAKE_CURRENT_BINARY_DIR}/gscConfig.cmake INSTALL_DESTINATION ${package_dir})
write_basic_package_version_file(${CMAKE_CURRENT_BINARY_DIR}/gscConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/gscConfig.cmake ${CMAKE_CURRENT_BINARY_DIR}/gscConfigVersion.cmake
        DESTINATION ${package_dir})
