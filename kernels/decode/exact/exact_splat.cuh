// SPDX-License-Identifier: Apache-2.0
// Steps that both decoders of the tier `exact` share: find an anchor's chunk, a Gaussian's bins, and its splat.
#pragma once

#include "kernels/cuda/anchor_shape.cuh"
#include "kernels/decode/decode_body.h"
#include "kernels/decode/exact/decode_exact_cuda.h"
#include "kernels/decode/slots.cuh"

namespace gsc {

// Index of the chunk that holds an anchor.
__device__ __forceinline__ uint32_t chunkOf(const ModelView& view, uint32_t anchor)
{
    uint32_t low = 0, high = uint32_t(view.params->chunk_count);
    while (high - low > 1) {
        const uint32_t mid = (low + high) / 2;
        if (view.chunks[mid].anchor_first <= anchor)
            low = mid;
        else
            high = mid;
    }
    return low;
}

// Bins with pixels that the trainers' tiles cover and where alpha can reach 1/255, in the columns that are drawn;
// kNoBins if there are none.
__device__ __forceinline__ uint32_t binBox(const DecodeFrame& frame, uint32_t e, const Footprint<float>& f,
                                           float opacity)
{
    const EyeParams& eye = frame.eyes[e];
    const uint32_t bin_height = frame.grid.height;
    float x0 = float(f.tiles.x0 * int32_t(kTileSize)), x1 = float(f.tiles.x1 * int32_t(kTileSize) - 1);
    float y0 = float(f.tiles.y0 * int32_t(kTileSize)), y1 = float(f.tiles.y1 * int32_t(kTileSize) - 1);
    // A needle is drawn wherever the trainers' tiles are: its conic comes from a determinant that is mostly rounding,
    // and reaches further than the covariance says. Others get bounds from approximate functions, whose error the
    // margins cover; an opacity is at least 1/255.
    const float ac = f.cov.a * f.cov.c;
    if (ac - f.cov.b * f.cov.b > 1e-4f * ac && f.cov.a > 0.0f && f.cov.c > 0.0f) {
        const float reach = 2.0f * __logf(255.0f * opacity) * 1.0001f + 1e-3f;
        const float ex = squareRoot(reach * f.cov.a) * 1.001f + 0.01f,
                    ey = squareRoot(reach * f.cov.c) * 1.001f + 0.01f;
        x0 = fmaxf(x0, floorf(f.x - ex));
        x1 = fminf(x1, ceilf(f.x + ex));
        y0 = fmaxf(y0, floorf(f.y - ey));
        y1 = fminf(y1, ceilf(f.y + ey));
    }
    x0 = fmaxf(x0, frame.bands[e].first);
    x1 = fminf(x1, frame.bands[e].last);
    y1 = fminf(y1, float(eye.height) - 1.0f);
    if (x0 > x1 || y0 > y1)
        return kNoBins;
    return uint32_t(x0) / kBinWidth | uint32_t(y0) / bin_height << 8 | uint32_t(x1) / kBinWidth << 16 |
           uint32_t(y1) / bin_height << 24;
}

__device__ __forceinline__ ExactSplat exactSplat(const Footprint<float>& f, const GaussianOf<float>& g)
{
    return {f.x,
            f.y,
            {f.conic[0], f.conic[1], f.conic[2]},
            g.opacity,
            {g.color[0], g.color[1], g.color[2]},
            uint32_t(g.order),
            uint16_t(f.tiles.x0),
            uint16_t(f.tiles.y0),
            uint16_t(f.tiles.x1),
            uint16_t(f.tiles.y1)};
}

} // namespace gsc
