// SPDX-License-Identifier: Apache-2.0
// Tells where the pixels of a bin lie in an eye's image, and what they hold before and after blending. Used for short
// and long lists.
#pragma once

#include "kernels/blend/cuda/rules.cuh"

namespace gsc {

// A bin that is drawn by one eye.
struct BinOfEye {
    // entry: number of the list among those of both eyes (list x bins + bin); eye: the one that draws the bin
    uint32_t entry, eye;
};

// Bin number `i` in the order of blending, fullest first. Eyes that share a list follow each other.
__device__ __forceinline__ BinOfEye binAt(const BlendCudaArgs& args, uint32_t i)
{
    const uint32_t readers = args.shared_bins ? kMaxEyes : 1u, entry = args.bin_queue[i / readers];
    return {entry, args.shared_bins ? i % kMaxEyes : entry >= args.grid.bins() ? 1u : 0u};
}

// Place of a bin in the image of its eye, and the range of its list.
struct Area {
    uint32_t eye, bin_x, bin_y; // bin_x, bin_y: first pixel of the bin
    uint32_t begin, end;        // range of the bin's list in `keys`
};

// Fills `area`; returns false if the bin is not drawn: it lies left of the eye's image, or the eye's lens hides it.
template <typename T>
__device__ __forceinline__ bool areaOf(const BlendCudaArgs& args, const BinOfEye& target, Area& area)
{
    const uint32_t e = target.eye, entry = target.entry;
    const uint32_t bin = entry < args.grid.bins() ? entry : entry - args.grid.bins();
    const uint32_t eye_column = bin % args.grid.columns - (e == 0 ? args.grid.shift[0] : args.grid.shift[1]);
    area = {e, eye_column * kBinWidth, bin / args.grid.columns * (T::kBinRows * T::kHeight),
            entry == 0 ? 0u : min(args.cells[(entry << args.grid.slab_bits) - 1], args.pair_capacity),
            min(args.cells[((entry + 1) << args.grid.slab_bits) - 1], args.pair_capacity)};
    return eye_column < args.grid.columns && args.lens[e].shows(eye_column, area.bin_y / kLensSquare);
}

// Values of a pixel before blending: those of an empty pixel, or those that an earlier launch left. Transmittance is in
// the units of the rules, and below zero where there is no pixel. While depths are found, the image of depths holds the
// negative transmittance of pixels that have no depth yet.
struct Begun {
    float transmittance, color[3];
};

template <typename Rules>
__device__ __forceinline__ Begun begunPixel(const BlendCudaArgs& args, uint32_t e, uint32_t x, uint32_t y, bool goes_on)
{
    const uint32_t width = e == 0 ? args.width[0] : args.width[1], height = e == 0 ? args.height[0] : args.height[1];
    const bool inside = x < width && y < height;
    Begun begun{inside ? Rules::kWhole : -1.0f, {0, 0, 0}};
    if (goes_on && inside) {
        const size_t pixel = size_t(y) * width + x;
        if constexpr (Rules::kDepth) {
            const float depth = (e == 0 ? args.depth[0] : args.depth[1])[pixel];
            return {-depth, {depth, 0, 0}};
        }
        begun.transmittance = (e == 0 ? args.transmittance[0] : args.transmittance[1])[pixel];
        for (int i = 0; i < 3; ++i)
            begun.color[i] = (e == 0 ? args.image[0] : args.image[1])[pixel * 3 + i];
    } else if constexpr (Rules::kOnBackground && !Rules::kDepth) {
        for (int i = 0; i < 3; ++i)
            begun.color[i] = args.background[i];
    }
    return begun;
}

template <typename Rules>
__device__ __forceinline__ void endPixel(const BlendCudaArgs& args, uint32_t e, uint32_t x, uint32_t y,
                                         float transmittance, const float* color, bool last)
{
    const uint32_t width = e == 0 ? args.width[0] : args.width[1], height = e == 0 ? args.height[0] : args.height[1];
    if (x >= width || y >= height)
        return;
    const bool black = last && args.empty_is_black && args.counters->any_positive[e] == 0;
    const size_t at = size_t(y) * width + x;
    if constexpr (Rules::kDepth) {
        (e == 0 ? args.depth[0] : args.depth[1])[at] = transmittance < 0.0f ? color[0]
                                                       : last               ? INFINITY
                                                                            : -transmittance;
        return;
    }
    float* const pixel = (e == 0 ? args.image[0] : args.image[1]) + at * 3;
    for (int i = 0; i < 3; ++i)
        pixel[i] = black                           ? 0.0f
                   : Rules::kOnBackground || !last ? color[i]
                                                   : fmaf(fabsf(transmittance), args.background[i], color[i]);
    if (!last)
        (e == 0 ? args.transmittance[0] : args.transmittance[1])[at] = transmittance;
}

// Word of `unfinished` for list `entry` and eye `eye`.
__device__ __forceinline__ uint32_t& unfinishedOf(const BlendCudaArgs& args, uint32_t entry, uint32_t eye)
{
    return args.unfinished[entry + (args.shared_bins ? eye * args.grid.bins() : 0u)];
}

// Pixels of this lane in pair `i` of the sub-tile pairs of its warp. (x0, y0): first pixel of the bin, in the
// coordinates that the rules use.
template <typename T>
__device__ __forceinline__ PixelPair pixelPair(uint32_t x0, uint32_t y0, const PairPlace& pairs, uint32_t i)
{
    const uint32_t lane = threadIdx.x % kHalf;
    const uint32_t x = x0 + (pairs.column + halfOfWarp()) * T::kWidth + lane % T::kLaneWidth;
    return {{float(x), float(x + T::kLaneWidth)}, float(y0 + (pairs.row + i) * T::kHeight + lane / T::kLaneWidth)};
}

// Calls f(row, i, x, y) for the pixels of this lane, two in each pair of its warp; (x, y) counts from the bin's first
// pixel.
template <typename T, typename F>
__device__ __forceinline__ void forPixels(const PairPlace& pairs, F&& f)
{
    const uint32_t lane = threadIdx.x % kHalf;
#pragma unroll
    for (uint32_t row = 0; row < T::kRows; ++row)
#pragma unroll
        for (uint32_t i = 0; i < 2; ++i)
            f(row, i, (pairs.column + halfOfWarp()) * T::kWidth + i * T::kLaneWidth + lane % T::kLaneWidth,
              (pairs.row + row) * T::kHeight + lane / T::kLaneWidth);
}

// Adds to the frame's counters the evaluations of each eye, of which all lanes of a warp hold the same number.
__device__ __forceinline__ void countEvaluations(const BlendCudaArgs& args, const uint32_t (&evaluations)[kMaxEyes])
{
    for (uint32_t e = 0; e < kMaxEyes; ++e)
        if ((threadIdx.x & 31u) == 0 && evaluations[e] != 0)
            atomicAdd(&args.counters->evaluations[e], 32ull * evaluations[e]);
}

} // namespace gsc
