# SPDX-License-Identifier: Apache-2.0
# Zstandard packs archives. A build without it says so where a file needs it.
target_link_libraries(gsc_format PRIVATE Threads::Threads)
find_path(GSC_ZSTD_INCLUDE_DIR zstd.h DOC "folder of Zstandard's header")
find_library(GSC_ZSTD_LIBRARY NAMES zstd DOC "Zstandard's library")
set(has_zstd 0)
if(NOT GSC_WITH_ZSTD STREQUAL "OFF")
  if(GSC_ZSTD_INCLUDE_DIR AND GSC_ZSTD_LIBRARY)
    set(has_zstd 1)
    target_include_directories(gsc_format SYSTEM PRIVATE ${GSC_ZSTD_INCLUDE_DIR})
    # by name, so that the installed package does not name a place of this machine
    set(zstd zstd)
    if(GSC_STATIC_RUNTIME)
      set(zstd :libzstd.a)
    endif()
    target_link_libraries(gsc_format PRIVATE -l${zstd})
  elseif(GSC_WITH_ZSTD STREQUAL "ON")
    message(FATAL_ERROR "GSC_WITH_ZSTD is ON, but zstd.h or libzstd was not found; install it, or set it to OFF")
  endif()
endif()
# not of the target: its precompiled header serves others
set_source_files_properties(archive/codec.cpp PROPERTIES COMPILE_DEFINITIONS GSC_HAS_ZSTD=${has_zstd}
                                                         SKIP_PRECOMPILE_HEADERS ON)
message(STATUS "archives: zstd=${has_zstd}")
