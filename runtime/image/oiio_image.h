// SPDX-License-Identifier: Apache-2.0
// Functions by which image_io.cpp writes and reads images with OpenImageIO: the module gsc_image_oiio.
#pragma once

#include "runtime/image/image_io.h"

#include <string>
#include <vector>

namespace gsc {

// Threads that OpenVDB's log, which OpenImageIO brings along, starts when it is loaded.
constexpr size_t kOiioThreads = 4;

struct OiioImageFunctions {
    // Before the first picture: no pools of threads for it.
    void (*startNoThreads)();

    // The bytes of the file. `extension` (".png", ".exr") decides the format, `path` is for messages. Throws Error:
    // Unsupported, Internal.
    std::vector<unsigned char> (*encode)(const std::string& path, const std::string& extension, const Image& image,
                                         PixelDepth depth);
    // Throws Error (Io, InvalidFile, Unsupported).
    Image (*read)(const std::string& path);
};

} // namespace gsc
