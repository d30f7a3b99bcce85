// SPDX-License-Identifier: Apache-2.0
// Functions by which image_io.cpp writes and reads images with OpenImageIO: the module gsc_image_oiio.
#pragma once

#include "runtime/image/image_io.h"

#include <string>
#include <vector>

namespace gsc {

// Number of threads that start when the module is loaded: those of OpenVDB's log, which comes with OpenImageIO.
constexpr size_t kOiioThreads = 4;

struct OiioImageFunctions {
    // Keeps the libraries from starting threads; call it before the first picture.
    void (*startNoThreads)();

    // Returns the bytes of an image file. `extension` (".png", ".exr") decides the format; `path` is named in
    // messages. Throws Error: Unsupported, Internal.
    std::vector<unsigned char> (*encode)(const std::string& path, const std::string& extension, const Image& image,
                                         PixelDepth depth);
    // Reads an image file. Throws Error (Io, InvalidFile, Unsupported).
    Image (*read)(const std::string& path);
};

} // namespace gsc
