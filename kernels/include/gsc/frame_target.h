// SPDX-License-Identifier: Apache-2.0
// Destination of an eye's picture. Plain data, included by C++ and CUDA alike.
#pragma once

#include <cstddef>
#include <cstdint>

namespace gsc {

// Formats of a pixel. Channels are interleaved, row 0 is at the top, alpha is 1. Colours are stored as they are
// blended, which is display-encoded.
enum class PixelFormat : uint32_t {
    Rgb32f = 0,  // 12 bytes, three floats, not clamped
    Rgba16f = 1, // 8 bytes, each value rounded to the nearest half float, on a tie to the even one
    // 4 bytes, each value rounded to the nearest of 0 to 255 as in 8-bit image files; 0 for values below 0 and NaN
    Rgba8 = 2,
    Bgra8 = 3, // 4 bytes as Rgba8, but blue comes first
};

constexpr size_t pixelBytes(PixelFormat format)
{
    return format == PixelFormat::Rgb32f ? 12 : format == PixelFormat::Rgba16f ? 8 : 4;
}

struct FrameTarget {
    enum class Kind : uint32_t {
        None = 0,    // none: the picture stays in the renderer's memory, as Rgb32f
        Host = 1,    // `pixels` is memory of this process
        Device = 2,  // `pixels` is memory of the renderer's device; if that is the CPU, memory of this process
        Surface = 3, // a cudaSurfaceObject_t of the renderer's device, as wide and high as the picture; not Rgb32f
    };

    Kind kind = Kind::None;
    PixelFormat format = PixelFormat::Rgb32f;
    void* pixels = nullptr;         // one row for each row of the picture, `pitch` bytes apart; for Host and Device
    size_t pitch = 0;               // bytes from row to row, a multiple of a pixel; 0 = rows without a gap
    unsigned long long surface = 0; // surface for Kind::Surface
    // Memory for depths, separate from that of the pixels. The depth of a pixel is fp32: view z (world units) of the
    // first Gaussian behind which less than half of the light goes on, infinity if there is none.
    float* depth = nullptr; // rows `depth_pitch` bytes apart; for Host and Device; null = depths are not wanted
    size_t depth_pitch = 0; // bytes from row to row, a multiple of a value; 0 = rows without a gap
    unsigned long long depth_surface = 0; // surface for Kind::Surface, a float per pixel; 0 = depths are not wanted

    [[nodiscard]] bool onHost() const { return kind == Kind::Host; }
    [[nodiscard]] constexpr bool hasDepth() const { return depth != nullptr || depth_surface != 0; }
};

// Bytes from row to row of a target in memory whose picture is `width` pixels wide.
constexpr size_t pitchOf(const FrameTarget& target, uint32_t width)
{
    return target.pitch != 0 ? target.pitch : width * pixelBytes(target.format);
}

constexpr size_t depthPitchOf(const FrameTarget& target, uint32_t width)
{
    return target.depth_pitch != 0 ? target.depth_pitch : width * sizeof(float);
}

// Rows of depths in memory of this process; z is null if depths are not wanted.
template <typename Real>
struct DepthRows {
    Real* z = nullptr;
    size_t stride = 0; // number of values from row to row
};

// Target for a picture of width x height x 3 floats in memory of this process.
inline FrameTarget hostTarget(float* pixels)
{
    return {FrameTarget::Kind::Host, PixelFormat::Rgb32f, pixels, 0, 0};
}

} // namespace gsc
