// SPDX-License-Identifier: Apache-2.0
// Cuts a bin into sub-tiles of 32 pixels, and finds which of them the ellipse of a splat touches.
#pragma once

#include "kernels/cuda/ptx.cuh"
#include "kernels/frame/device_model.h"

namespace gsc {

// Ellipse A dx^2 + 2 B dx dy + C dy^2 = reach on which alpha is 1/255, prepared for tests against sub-tiles.
struct Bounds {
    float extent_x, extent_y; // half the width and height of the ellipse's box, pixels
    float lean;               // the rightmost point of the ellipse is at dy = -lean
    float inv_a, half_b, det, a_reach;
};

__device__ __forceinline__ Bounds unbounded()
{
    return {INFINITY, INFINITY, 0.0f, 1.0f, 0.0f, 0.0f, INFINITY};
}

// Bounds of a quadratic form. det: determinant a c - b^2, above zero.
__device__ __forceinline__ Bounds boundsOf(float a, float b, float c, float det, float reach)
{
    const float inv_det = __fdividef(1.0f, det);
    // note: 1.001 covers the rounding of the determinant, as far as callers allow it
    const float extent_x = sqrtApprox(reach * c * inv_det) * 1.001f + 0.02f;
    const float extent_y = sqrtApprox(reach * a * inv_det) * 1.001f + 0.02f;
    return {extent_x, extent_y, __fdividef(b, c) * extent_x, __fdividef(1.0f, a), b, det, a * reach};
}

// Pixels of the tiles in which the trainers' code draws a splat, those of its 3-sigma square. The ends are inclusive
// and may lie outside the image.
struct PixelBox {
    float x0, y0, x1, y1;
};

// Sub-tiles of a bin, 32 pixels each, and how many of them a warp has: kRowCount pairs below each other. Each half of
// the warp blends one sub-tile of a pair, each lane two pixels of a row, so that a splat is read and computed once for
// both pixels.
template <uint32_t kWidthOfSubTile, uint32_t kBinHeight, uint32_t kRowCount>
struct Tile {
    static constexpr uint32_t kWidth = kWidthOfSubTile, kHeight = 32 / kWidth, kLaneWidth = kWidth / 2;
    static constexpr uint32_t kBinRows = kBinHeight / kHeight, kBinColumns = kBinWidth / kWidth;
    static constexpr uint32_t kBinPairs = kBinRows * kBinColumns / 2;
    static constexpr uint32_t kRows = kRowCount, kColumns = 2;
    static_assert(kBinRows * kBinColumns <= 32); // so that a mask of sub-tiles fits a word

    float transmittance[kRows][2]; // light of the pixels, in the units of the rules: Rules::takesLight()
    float color[kRows][2][3];
};

// First sub-tile of a warp's pairs in a bin: row and column, counted in sub-tiles.
struct PairPlace {
    uint32_t row, column;
};

// Two neighbouring pixels of a row, in the coordinates that the rules use.
struct PixelPair {
    float x[2], y;
};

constexpr uint32_t kHalf = 16, kHalfMask = 0xffffu; // kHalf: lanes of half a warp; kHalfMask: a bit for each of them

__device__ __forceinline__ uint32_t halfOfWarp()
{
    return threadIdx.x >> 4 & 1u;
}

// Returns in bit 0 whether `value` is true for some lane of the warp's first half, in bit 1 for the second. All lanes
// of the warp call it together. note: uses sums, because ptxas 13.0 takes two bits made by comparisons for zero where
// both are set
__device__ __forceinline__ uint32_t halvesThat(bool value)
{
    const uint32_t lanes = __ballot_sync(~0u, value);
    return ((lanes & kHalfMask) + kHalfMask) >> kHalf | ((lanes >> kHalf) + kHalfMask) >> kHalf << 1;
}

// Bits of the lanes in this half of the warp for which `value` is true; bit 0 is the first lane of the half. All lanes
// of the warp call it together.
__device__ __forceinline__ uint32_t ballotOfHalf(bool value)
{
    return __ballot_sync(~0u, value) >> (threadIdx.x & kHalf) & kHalfMask;
}

// Sub-tiles of the bin with first pixel (x0, y0) that the ellipse round (x, y) touches within `box`, whose edges are
// edges of sub-tiles too. May contain sub-tiles that are not touched. Bit row * kBinColumns + column.
template <typename T>
__device__ __forceinline__ uint32_t subTileMask(const Bounds& q, const PixelBox& box, float x, float y, float x0,
                                                float y0)
{
    static_assert(uint32_t(kTileSize) % T::kWidth == 0 && uint32_t(kTileSize) % T::kHeight == 0);
    const float left = x - x0, top = y - y0;
    uint32_t mask = 0;
#pragma unroll
    for (uint32_t row = 0; row < T::kBinRows; ++row) {
        const float low = fmaxf(fmaxf(float(T::kHeight * row), box.y0 - y0) - top, -q.extent_y);
        const float high = fminf(fminf(float(T::kHeight * (row + 1) - 1), box.y1 - y0) - top, q.extent_y);
        const float tr = fminf(fmaxf(-q.lean, low), high), tl = fminf(fmaxf(q.lean, low), high);
        const float right =
            fminf((sqrtApprox(fmaxf(q.a_reach - q.det * tr * tr, 0.0f)) - q.half_b * tr) * q.inv_a + 0.02f + left,
                  box.x1 - x0);
        const float begin =
            fmaxf(left - 0.02f - (sqrtApprox(fmaxf(q.a_reach - q.det * tl * tl, 0.0f)) + q.half_b * tl) * q.inv_a,
                  box.x0 - x0);
        // columns whose last pixel is not left of `begin` and whose first pixel is not right of `right`
        const int first = max(__float2int_ru((begin + 1.0f) * (1.0f / T::kWidth)), 1) - 1;
        const int last = min(__float2int_rd(right * (1.0f / T::kWidth)), int(T::kBinColumns) - 1);
        if (low <= high && right >= 0.0f && first <= last)
            mask |= ((2u << last) - (1u << first)) << (row * T::kBinColumns);
    }
    return mask;
}

} // namespace gsc
