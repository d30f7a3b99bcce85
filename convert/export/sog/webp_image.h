// SPDX-License-Identifier: Apache-2.0
// Writes and reads lossless WebP. The pixels are data here: all four channels come back bit for bit.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace gsc {

constexpr uint32_t kMostWebpPixels = 16383; // most pixels of a side

// Rows from the top; each pixel is red, green, blue, alpha.
struct ByteImage {
    uint32_t width = 0, height = 0;
    std::vector<uint8_t> rgba;

    ByteImage() = default;
    // Makes an image that is black and opaque.
    ByteImage(uint32_t width_, uint32_t height_);
    [[nodiscard]] uint8_t* pixel(size_t i) { return rgba.data() + 4 * i; }
    [[nodiscard]] const uint8_t* pixel(size_t i) const { return rgba.data() + 4 * i; }
};

// Precondition: both sides have 1 to kMostWebpPixels pixels. Throws Error(OutOfMemory).
std::vector<std::byte> encodeWebp(const ByteImage& image);
// Decodes a WebP image. `name` is used in messages. Throws Error(InvalidFile).
ByteImage decodeWebp(std::span<const std::byte> file, const std::string& name);

} // namespace gsc
