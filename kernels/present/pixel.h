// SPDX-License-Identifier: Apache-2.0
// Converts a colour as blended to the bytes that a target stores, equally on host and device.
#pragma once

#include <gsc/half.h>
#include <gsc/frame_target.h>

namespace gsc {

// Byte of a colour value, as torchvision and image files have it: trunc(clamp(255 x + 0.5, 0, 255)); 0 for NaN.
GSC_HD uint8_t pixelByte(float value)
{
    const float scaled = 255.0f * value + 0.5f;
    return uint8_t(scaled > 0 ? (scaled < 255.0f ? scaled : 255.0f) : 0.0f);
}

struct PixelBytes {
    uint8_t r, g, b, a;
};
struct PixelBytesBlueFirst {
    uint8_t b, g, r, a;
};
struct PixelHalves {
    uint16_t r, g, b, a;
};

GSC_HD PixelBytes pixelBytesOf(const float* rgb)
{
    return {pixelByte(rgb[0]), pixelByte(rgb[1]), pixelByte(rgb[2]), 255};
}

GSC_HD PixelBytesBlueFirst pixelBytesBlueFirstOf(const float* rgb)
{
    return {pixelByte(rgb[2]), pixelByte(rgb[1]), pixelByte(rgb[0]), 255};
}

GSC_HD PixelHalves pixelHalvesOf(const float* rgb)
{
    constexpr uint16_t kOne = 0x3c00;
    return {floatToHalf(rgb[0]), floatToHalf(rgb[1]), floatToHalf(rgb[2]), kOne};
}

} // namespace gsc
