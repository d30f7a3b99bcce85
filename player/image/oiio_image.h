// SPDX-License-Identifier: Apache-2.0
// What OpenImageIO adds to image_io.cpp. oiio_image.cpp is the module gsc_image_oiio, to which oiio_image_load.cpp passes
// calls; oiio_image_none.cpp stands in where the build goes without it.
#pragma once

#include "player/image/image_io.h"

#include <string>
#include <vector>

namespace gsc {

// Lower-case extensions with their dot; empty without OpenImageIO. Loads nothing.
std::vector<std::string> oiioExtensions();

// Throws Error(Unsupported) where the module is missing or of another build.
void loadOiio();

// The bytes of the file. `extension` (one of the above) decides the format, `path` is for messages. Throws Error:
// Unsupported, Internal.
std::vector<unsigned char> encodeOiioImage(const std::string& path, const std::string& extension, const Image& image,
                                           PixelDepth depth);
// Throws Error (Io, InvalidFile, Unsupported).
Image readOiioImage(const std::string& path);

struct OiioImageFunctions { // of the module
    decltype(&encodeOiioImage) encode;
    decltype(&readOiioImage) read;
};

} // namespace gsc
