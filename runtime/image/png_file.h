// SPDX-License-Identifier: Apache-2.0
// PNG files (ISO/IEC 15948), with libdeflate: some ten times as fast to write as through OpenImageIO.
#pragma once

#include "runtime/image/image_io.h"

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace gsc {

// The bytes of a file of RGB with wholeValue() in each sample, rows filtered by their left neighbour.
std::vector<unsigned char> encodePng(const Image& image, PixelDepth depth);

// Every colour type with red, green and blue, palettes and interlaced files too; alpha is left out. `path` is for
// messages. Throws Error: InvalidFile; Unsupported (grey).
Image decodePng(std::span<const std::byte> file, const std::string& path);

} // namespace gsc
