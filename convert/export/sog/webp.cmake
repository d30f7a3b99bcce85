# SPDX-License-Identifier: Apache-2.0
# SOG files, where libwebp is: its pkg-config file is not needed
find_path(GSC_WEBP_INCLUDE_DIR webp/encode.h DOC "folder of libwebp's headers (Debian: libwebp-dev)")
find_library(GSC_WEBP_LIBRARY webp DOC "libwebp (Debian: libwebp-dev)")
gsc_part(sog GSC_WITH_WEBP has_webp GSC_WEBP_INCLUDE_DIR webp/encode.h GSC_WEBP_LIBRARY libwebp)
if(has_webp)
  target_sources(gsc_export PRIVATE sog/codebook.cpp sog/sog_file.cpp sog/webp_image.cpp sog/zip_bundle.cpp)
  target_include_directories(gsc_export SYSTEM PRIVATE ${GSC_WEBP_INCLUDE_DIR} ${GSC_LIBZIP_INCLUDE_DIR})
  target_link_libraries(gsc_export PRIVATE gsc_input ${GSC_WEBP_LIBRARY} ${GSC_LIBZIP_LIBRARY})
else()
  target_sources(gsc_export PRIVATE sog/sog_file_off.cpp)
endif()
set(GSC_HAVE_WEBP ${has_webp} CACHE INTERNAL "SOG files can be written and read")
