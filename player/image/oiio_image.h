// SPDX-License-Identifier: Apache-2.0
// What OpenImageIO adds to image_io.cpp: the module gsc_image_oiio.
#pragma once

#include "player/image/image_io.h"

#include <string>
#include <vector>

namespace gsc {

struct OiioImageFunctions {
    // The bytes of the file. `extension` (".png", ".exr") decides the format, `path` is for messages. Throws Error:
    // Unsupported, Internal.
    std::vector<unsigned char> (*encode)(const std::string& path, const std::string& extension, const Image& image,
                                         PixelDepth depth);
    // Throws Error (Io, InvalidFile, Unsupported).
    Image (*read)(const std::string& path);
};

} // namespace gsc
