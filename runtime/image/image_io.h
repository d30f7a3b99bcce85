// SPDX-License-Identifier: Apache-2.0
// Image files: PNG (8 and 16 bit) and PFM, and through OpenImageIO, where the build has it, EXR (32-bit float), JPEG and
// WebP (8 bit, kLossyQuality) and what else it reads.
// EXR and PFM hold the values as rendered: display values as in a PNG, not linear light.
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

namespace gsc {

struct Image {
    uint32_t width = 0, height = 0;
    std::vector<float> pixels; // height x width x 3 values, RGB interleaved, row 0 on top
};

constexpr uint32_t kMostImageSide = 32768; // largest width and height of an image that is read, pixels

constexpr int kLossyQuality = 95; // quality of JPEG (without subsampled colours) and WebP, 100 at most

enum class PixelDepth { Eight, Sixteen }; // number of bits per channel of a PNG

// Converts a value to the whole number that files and streams hold, by torchvision's rule in single precision:
// trunc(clamp(max x + 0.5, 0, max)); NaN becomes 0.
template <typename Whole>
Whole wholeValue(float value)
{
    constexpr auto kMost = float(std::numeric_limits<Whole>::max());
    const float scaled = kMost * value + 0.5f;
    return scaled > 0.0f ? Whole(scaled < kMost ? scaled : kMost) : Whole(0);
}

// Writes an image in the format of the path's extension; a PNG holds wholeValue() of each value, and so
// does, before its losses, a JPEG or WebP. The file gets its
// name only when it is complete. Throws Error: Io, also if the file exists by then and `overwrite` is false;
// Unsupported for an extension that this build cannot write, naming those that it can.
void writeImage(const std::string& path, const Image& image, PixelDepth depth, bool overwrite);
// Reads an image; whole numbers become value / max. PFM is told by the extension, every other
// kind by its content. Throws Error (Io, InvalidFile, Unsupported).
Image readImage(const std::string& path);

// Returns the extensions that writeImage() takes in this build, such as ".pfm, .png, .exr".
std::string imageExtensions();
// Loads the module that writeImage() needs for `path`, so that a missing module is an error before the first frame is
// drawn. Throws Error(Unsupported).
void loadImageWriter(const std::string& path);
// Returns true if writeImage() takes the extension of `path`.
bool isImageExtension(const std::string& path);
// Returns true if the extension of `path` is of a kind that keeps less than an image has.
bool isLossyExtension(const std::string& path);
// Returns true if this build has OpenImageIO, and so reads and writes more than PNG and PFM.
bool hasOpenImageIo();

} // namespace gsc
