# SPDX-License-Identifier: Apache-2.0
# Zstandard packs archives. A build without it says so where a file needs it.
target_link_libraries(gsc_format PRIVATE Threads::Threads)
find_path(GSC_ZSTD_INCLUDE_DIR zstd.h DOC "folder of Zstandard's header")
set(zstd_name zstd)
if(GSC_STATIC_RUNTIME)
  set(zstd_name libzstd.a)
endif()
find_library(GSC_ZSTD_LIBRARY NAMES ${zstd_name} DOC "Zstandard's library")
gsc_part(archives GSC_WITH_ZSTD has_zstd GSC_ZSTD_INCLUDE_DIR zstd.h GSC_ZSTD_LIBRARY libzstd)
if(has_zstd)
  target_include_directories(gsc_format SYSTEM PRIVATE ${GSC_ZSTD_INCLUDE_DIR})
  # the installed package has it by name: it does not name a place of this machine
  set(zstd_option -lzstd)
  if(GSC_STATIC_RUNTIME)
    set(zstd_option -l:libzstd.a)
  endif()
  target_link_libraries(gsc_format PRIVATE "$<BUILD_INTERFACE:${GSC_ZSTD_LIBRARY}>" "$<INSTALL_INTERFACE:${zstd_option}>")
endif()
# not of the target: its precompiled header serves others
set_source_files_properties(archive/codec.cpp PROPERTIES COMPILE_DEFINITIONS GSC_HAS_ZSTD=${has_zstd}
                                                         SKIP_PRECOMPILE_HEADERS ON)
set(GSC_HAVE_ZSTD ${has_zstd} CACHE INTERNAL "archives can be written and read")
