// SPDX-License-Identifier: Apache-2.0
// Image files. PNG (8 and 16 bit) and EXR (32-bit float) through OpenImageIO where the build has it, PFM always.
// EXR and PFM hold the values as rendered: display values as in a PNG, not linear light.
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

namespace gsc {

struct Image {
    uint32_t width = 0, height = 0;
    std::vector<float> pixels; // height x width x 3, interleaved RGB, row 0 on top
};

enum class PixelDepth { Eight, Sixteen }; // bits per channel of a PNG

// A value as files and streams of whole numbers hold it: torchvision's rule in its own precision, trunc(clamp(max x + 0.5,
// 0, max)); NaN becomes 0.
template <typename Whole>
Whole wholeValue(float value)
{
    constexpr auto kMost = float(std::numeric_limits<Whole>::max());
    const float scaled = kMost * value + 0.5f;
    return scaled > 0.0f ? Whole(scaled < kMost ? scaled : kMost) : Whole(0);
}

// By file extension. PNG holds wholeValue(). Writes a temporary file
// and renames it. Throws Error (Io: without `overwrite` also where the file is there by then; Unsupported: an extension
// this build cannot write, naming those it can).
void writeImage(const std::string& path, const Image& image, PixelDepth depth, bool overwrite);
// Integers become value / max. Throws Error (Io, InvalidFile, Unsupported).
Image readImage(const std::string& path);

// Extensions writeImage() takes in this build, such as ".pfm, .png, .exr".
std::string imageExtensions();
// Loads the module that writeImage() needs for `path`, so that a missing one is an error before the first frame. Throws
// Error(Unsupported).
void loadImageWriter(const std::string& path);
// True if writeImage() takes the extension of `path`.
bool isImageExtension(const std::string& path);

} // namespace gsc
