// SPDX-License-Identifier: Apache-2.0
// Destination of an eye's picture. Plain data, included by C++ and CUDA alike.
#pragma once

#include <cstddef>
#include <cstdint>

namespace gsc {

// Channels are interleaved, row 0 is on top, alpha is 1. Colours are those of the blend, which are display-encoded.
enum class PixelFormat : uint32_t {
    Rgb32f = 0,  // 12 bytes, unclamped
    Rgba16f = 1, // 8 bytes, nearest half, even on a tie
    Rgba8 = 2,   // 4 bytes, nearest of 0 to 255 as 8-bit image files have it; below 0 and NaN 0
    Bgra8 = 3,   // Rgba8 with blue first
};

constexpr size_t pixelBytes(PixelFormat format)
{
    return format == PixelFormat::Rgb32f ? 12 : format == PixelFormat::Rgba16f ? 8 : 4;
}

struct FrameTarget {
    enum class Kind : uint32_t {
        None = 0,    // the picture stays where it is drawn, as Rgb32f
        Host = 1,    // memory of this process
        Device = 2,  // memory of the renderer's device; of a renderer on the host, memory of this process
        Surface = 3, // a cudaSurfaceObject_t of the renderer's device, as wide and high as the eye; not Rgb32f
    };

    Kind kind = Kind::None;
    PixelFormat format = PixelFormat::Rgb32f;
    void* pixels = nullptr;         // height rows of `pitch` bytes; of Host and Device
    size_t pitch = 0;               // bytes from row to row, whole pixels; 0 = rows without a gap
    unsigned long long surface = 0; // CUDA surface of Kind::Surface
    // Memory for depths, beside the pixels: fp32, view z (world units) of the first Gaussian behind which less than
    // half of the light goes on, infinity if there is none.
    float* depth = nullptr;               // height rows of `depth_pitch` bytes; of Host and Device; null = not wanted
    size_t depth_pitch = 0;               // bytes from row to row, whole values; 0 = rows without a gap
    unsigned long long depth_surface = 0; // CUDA surface of Kind::Surface, one float a pixel; 0 = not wanted

    [[nodiscard]] bool onHost() const { return kind == Kind::Host; }
    [[nodiscard]] constexpr bool hasDepth() const { return depth != nullptr || depth_surface != 0; }
};

// Bytes from row to row of a target in memory, pixels wide.
constexpr size_t pitchOf(const FrameTarget& target, uint32_t width)
{
    return target.pitch != 0 ? target.pitch : width * pixelBytes(target.format);
}

constexpr size_t depthPitchOf(const FrameTarget& target, uint32_t width)
{
    return target.depth_pitch != 0 ? target.depth_pitch : width * sizeof(float);
}

// Depths of a picture in memory of this process. None where `z` is null.
template <typename Real>
struct DepthRows {
    Real* z = nullptr;
    size_t stride = 0; // values from row to row
};

// A picture of width x height x 3 floats in memory of this process.
inline FrameTarget hostTarget(float* pixels)
{
    return {FrameTarget::Kind::Host, PixelFormat::Rgb32f, pixels, 0, 0};
}

} // namespace gsc
