// SPDX-License-Identifier: Apache-2.0
// The inner loops of LPIPS. Pixels lie in rows, the channels of a pixel together.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gsc {

// Widths are computed in multiples of this many pixels: rows have room for a multiple, and two columns of border more.
constexpr uint32_t kConvolveTile = 12;
constexpr uint32_t kConvolveBlock = 32; // output channels whose weights lie together; counts are multiples of it

struct ConvolveArgs {
    const float* in;           // the pixel above and left of the first output
    size_t in_pixel, in_row;   // floats
    uint32_t in_channels;      // at most 16, or a multiple of 16
    const float* weight;       // packConvolution()
    const float* bias;         // per output channel
    float* out;                // the first pixel
    size_t out_pixel, out_row; // floats
    uint32_t out_channels;     // a multiple of kConvolveBlock
    uint32_t rows, tiles;      // rows; tiles of kConvolveTile pixels in each
};

// [out][in][3][3] as convolve3x3() reads it.
std::vector<float> packConvolution(std::span<const float> weight, uint32_t in_channels, uint32_t out_channels);

// out = max(0, bias + in * weight).
void convolve3x3(const ConvolveArgs& args);

// Sum over a row's pixels of sum_c head[c] (a[c] / |a| - b[c] / |b|)^2; `channels` is a multiple of 16.
double unitDistance(const float* a, const float* b, size_t pixel_pitch, uint32_t width, uint32_t channels,
                    const float* head);

} // namespace gsc
