// SPDX-License-Identifier: Apache-2.0
// Functions by which image_io.cpp writes EXR, JPEG and WebP and reads all but PNG and PFM with OpenImageIO: the module gsc_image_oiio.
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

    // The bytes of a file of the kind `kind`: "exr", "jpg", "jpeg" or "webp"; `path` is for messages. Throws Error:
    // Unsupported, also if the image is too large for the kind; Internal.
    std::vector<unsigned char> (*encode)(const std::string& path, const std::string& kind, const Image& image);
    // Throws Error (Io, InvalidFile, Unsupported).
    Image (*read)(const std::string& path);
};

} // namespace gsc
