// SPDX-License-Identifier: Apache-2.0
// The inner loops of LPIPS. Pixels are stored in rows; the channels of a pixel lie side by side.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gsc {

// Rows are computed in tiles of this many pixels: they have room for a multiple of it and for two columns of border.
constexpr uint32_t kConvolveTile = 12;
// output channels are computed in blocks of this many, whose weights lie together
constexpr uint32_t kConvolveBlock = 32;

struct ConvolveArgs {
    const float* in;           // address of the input pixel above and left of the first output pixel
    size_t in_pixel, in_row;   // distances from one pixel, and from one row, to the next, in floats
    uint32_t in_channels;      // number of input channels: at most 16, or a multiple of 16
    const float* weight;       // weights in the order of packConvolution()
    const float* bias;         // bias of each output channel
    float* out;                // address of the first output pixel
    size_t out_pixel, out_row; // distances from one pixel, and from one row, to the next, in floats
    uint32_t out_channels;     // number of output channels: a multiple of kConvolveBlock
    uint32_t rows, tiles;      // number of rows; number of tiles of kConvolveTile pixels in each row
};

// Sorts weights [out][in][3][3] into the order in which convolve3x3() reads them.
std::vector<float> packConvolution(std::span<const float> weight, uint32_t in_channels, uint32_t out_channels);

// Computes out = max(0, bias + in * weight), where * is a 3 x 3 convolution.
void convolve3x3(const ConvolveArgs& args);

// Returns the sum over the pixels of a row of sum_c head[c] (a[c] / |a| - b[c] / |b|)^2. `channels` is a multiple of
// 16.
double unitDistance(const float* a, const float* b, size_t pixel_pitch, uint32_t width, uint32_t channels,
                    const float* head);

} // namespace gsc
