// SPDX-License-Identifier: Apache-2.0
// What blending does with one splat, in each tier, and which sub-tiles of a warp's tile it touches.
#pragma once

#include "kernels/blend/blend_cuda.h"
#include "kernels/common/halves.cuh"
#include "kernels/common/ptx.cuh"
#include "kernels/math/blend.h"

namespace gsc {

// The ellipse A dx^2 + 2 B dx dy + C dy^2 = reach on which alpha is 1/255, prepared for tests against sub-tiles.
struct Bounds {
    float extent_x, extent_y; // half of its box, pixels
    float lean;               // the rightmost point lies at dy = -lean
    float inv_a, half_b, det, a_reach;
};

// A determinant is a difference that thin ellipses make inexact; `trusted`: the smallest, relative to A C, believed.
__device__ __forceinline__ Bounds boundsOf(float a, float b, float c, float reach, float trusted)
{
    const float det = a * c - b * b;
    if (!(det > trusted * a * c && a > 0.0f && c > 0.0f)) // also what is no ellipse: upstream draws it all the same
        return {INFINITY, INFINITY, 0.0f, 1.0f, 0.0f, 0.0f, INFINITY};
    const float inv_det = __fdividef(1.0f, det);
    // note: 1.001 covers the determinant's rounding at the bound above
    const float extent_x = sqrtf(reach * c * inv_det) * 1.001f + 0.02f;
    const float extent_y = sqrtf(reach * a * inv_det) * 1.001f + 0.02f;
    return {extent_x, extent_y, __fdividef(b, c) * extent_x, __fdividef(1.0f, a), b, det, a * reach};
}

// What blending reads of a splat, in shared memory: 64 bytes in the tier `fast`.
struct FastRules {
    using Splat = PackedSplat;

    struct alignas(16) Lit {
        float x, y, power[3], log_opacity, color[3];
        Bounds bounds;
    };
    static_assert(sizeof(Lit) == 64);

    static __device__ __forceinline__ Lit light(const Splat& s)
    {
        const float2 rg = halvesOf(*reinterpret_cast<const uint32_t*>(&s.color[0]));
        const float2 bo = halvesOf(*reinterpret_cast<const uint32_t*>(&s.color[2]));
        const float log_opacity = __log2f(bo.y);
        constexpr float kLog255 = 7.99435343685886f;
        return {s.x,
                s.y,
                {s.power[0], s.power[1], s.power[2]},
                log_opacity,
                {rg.x, rg.y, bo.x},
                boundsOf(s.power[0], 0.5f * s.power[1], s.power[2], log_opacity + kLog255 + 4e-3f, 3e-5f)};
    }

    static __device__ __forceinline__ bool coversTile(const Lit&, uint32_t, uint32_t) { return true; }

    static __device__ __forceinline__ float alpha(const Lit& s, const BlendCudaArgs& args, float px, float py)
    {
        const float dx = s.x - px, dy = s.y - py;
        const float power =
            fmaf(dy, fmaf(-s.power[2], dy, -s.power[1] * dx), fmaf(-s.power[0] * dx, dx, s.log_opacity));
        const float alpha = fminf(args.rules.alpha_cap, exp2Approx(power));
        return alpha >= kOpacityFloor ? alpha : 0.0f;
    }

    // Four splats in a row without a branch: their falloffs do not wait for each other, only the transmittance does. A
    // finished pixel's transmittance is negative, so it stays below the bound.
    static __device__ __forceinline__ void blend(const Lit* const (&splats)[4], const BlendCudaArgs& args, float px,
                                                 float py, float& T, float* color)
    {
        float alphas[4];
#pragma unroll
        for (uint32_t i = 0; i < 4; ++i)
            alphas[i] = alpha(*splats[i], args, px, py);
#pragma unroll
        for (uint32_t i = 0; i < 4; ++i) {
            // never contracted: bins are blended by two instances of this, which must agree to the last bit
            const float weight = __fmul_rn(alphas[i], T), next = __fsub_rn(T, weight);
            const bool drawn = next >= args.rules.stop; // the Gaussian that crosses the bound is not drawn
            const float w = drawn ? weight : 0.0f;
            for (int c = 0; c < 3; ++c)
                color[c] = fmaf(w, splats[i]->color[c], color[c]);
            T = drawn ? next : -fabsf(T);
        }
    }

    // Draws nothing anywhere.
    static __device__ __forceinline__ Lit nothing()
    {
        return {0, 0, {0, 0, 0}, -INFINITY, {0, 0, 0}, {}};
    }
};

struct ExactRules {
    using Splat = ExactSplat;

    struct alignas(16) Lit {
        ExactSplat splat;
        Bounds bounds;
    };

    static __device__ __forceinline__ Lit light(const Splat& s)
    {
        return {s, boundsOf(s.conic[0], s.conic[1], s.conic[2], 2.0f * __logf(255.0f * s.opacity) + 4e-3f, 1e-3f)};
    }

    static __device__ __forceinline__ bool coversTile(const Lit& s, uint32_t tx, uint32_t ty)
    {
        return tx >= s.splat.tx0 && tx < s.splat.tx1 && ty >= s.splat.ty0 && ty < s.splat.ty1;
    }

    static __device__ __forceinline__ void blend(const Lit* const (&splats)[4], const BlendCudaArgs& args, float px,
                                                 float py, float& T, float* color)
    {
#pragma unroll 1
        for (uint32_t i = 0; i < 4; ++i) {
            if (T <= 0.0f)
                return;
            const ExactSplat& s = splats[i]->splat;
            PixelState<float> pixel{{color[0], color[1], color[2]}, T, false};
            blendStep<float>(args.rules, s.conic, s.x - px, s.y - py, s.opacity, s.color, pixel);
            T = pixel.done ? -T : pixel.transmittance;
            for (int c = 0; c < 3; ++c)
                color[c] = pixel.color[c];
        }
    }

    static __device__ __forceinline__ Lit nothing()
    {
        return {};
    } // its opacity is zero
};

__device__ __forceinline__ float centerX(const FastRules::Lit& s)
{
    return s.x;
}
__device__ __forceinline__ float centerY(const FastRules::Lit& s)
{
    return s.y;
}
__device__ __forceinline__ float centerX(const ExactRules::Lit& s)
{
    return s.splat.x;
}
__device__ __forceinline__ float centerY(const ExactRules::Lit& s)
{
    return s.splat.y;
}

// A warp's tile: kRows x kColumns sub-tiles of 32 pixels, one of each per lane, kWidth pixels wide.
template <uint32_t kWidthOfSubTile, uint32_t kRowCount, uint32_t kColumnCount>
struct Tile {
    static constexpr uint32_t kWidth = kWidthOfSubTile, kHeight = 32 / kWidth;
    static constexpr uint32_t kRows = kRowCount, kColumns = kColumnCount;

    float transmittance[kRows][kColumns]; // < 0: finished, its absolute value is final
    float color[kRows][kColumns][3];
};

// Sub-tiles that the ellipse touches; errs towards more. Bit row * kColumns + column. (left, top): its centre relative
// to the tile; [first, last]: the tile's rows of pixels that are not finished.
template <typename T>
__device__ __forceinline__ uint32_t subTileMask(const Bounds& q, float left, float top, float first, float last)
{
    if (left + q.extent_x < 0.0f || left - q.extent_x > float(T::kWidth * T::kColumns - 1) ||
        top + q.extent_y < first || top - q.extent_y > last)
        return 0u;
    uint32_t mask = 0;
#pragma unroll
    for (uint32_t row = 0; row < T::kRows; ++row) {
        const float low = fmaxf(fmaxf(float(T::kHeight * row), first) - top, -q.extent_y);
        const float high = fminf(fminf(float(T::kHeight * (row + 1) - 1), last) - top, q.extent_y);
        if (low > high)
            continue;
        const float tr = fminf(fmaxf(-q.lean, low), high), tl = fminf(fmaxf(q.lean, low), high);
        const float right = (sqrtf(fmaxf(q.a_reach - q.det * tr * tr, 0.0f)) - q.half_b * tr) * q.inv_a + 0.02f + left;
        const float begin = left - 0.02f - (sqrtf(fmaxf(q.a_reach - q.det * tl * tl, 0.0f)) + q.half_b * tl) * q.inv_a;
#pragma unroll
        for (uint32_t column = 0; column < T::kColumns; ++column)
            if (begin <= float(T::kWidth * (column + 1) - 1) && right >= float(T::kWidth * column))
                mask |= 1u << (row * T::kColumns + column);
    }
    return mask;
}

} // namespace gsc
