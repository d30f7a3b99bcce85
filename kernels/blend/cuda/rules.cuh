// SPDX-License-Identifier: Apache-2.0
// Rules by which a splat changes a pixel: one set for each tier, and sets that find depths or count the cost.
#pragma once

#include "kernels/blend/blend_cuda.h"
#include "kernels/blend/cuda/sub_tiles.cuh"
#include "kernels/cuda/halves.cuh"
#include "kernels/cuda/ptx.cuh"
#include "kernels/math/blend.h"

namespace gsc {

// Marks a pixel as finished by making its light negative; the absolute value is final.
__device__ __forceinline__ float finished(float T)
{
    return __uint_as_float(__float_as_uint(T) | 0x80000000u); // one instruction, where -fabsf(T) takes two
}

// Rules of tier `fast`. Lit is a splat as blending reads it, in shared memory. 48 bytes: threads beside each other
// write them without meeting in a bank, which 64 would not do. log2 of the falloff at a pixel counted from the bin's
// first is -u^2 - v^2, with u = slope_x px + slope_y py + u0 and v = slope py + v0. Only the sums u and v lose digits,
// and few: slopes and u0 are large only for needles.
//
// Opacities are divided by kWhole and light is multiplied by it, so that their product is unchanged and an alpha below
// 1/255 is a subnormal number, which exp2Approx() flushes to zero: no comparison is needed. A pixel is finished once
// its light is below the bound; light only falls, so it stays finished. A pixel's colour starts as the background, and
// splats hold their colour less the background, so the light that is left is not needed in the end.
struct FastRules {
    using Splat = PackedSplat;
    static constexpr bool kDepth = false;
    static constexpr bool kInBin = true;        // pixels are counted from the first pixel of the bin
    static constexpr bool kCodes = true;        // splats have codes that tell which pixels a small splat touches
    static constexpr bool kOnBackground = true; // the colour of a pixel starts as the background
    static constexpr bool kSegments = true;     // the longest lists are cut into segments (segments.cuh)
    // blocks per multiprocessor of the kernel for long lists, which leaves 80 registers to a thread
    static constexpr uint32_t kLoneBlocks = 6;
    static constexpr float kWholeLog2 = 118.005646563141f; // log2(kWhole) = 126 - log2(255)
    static constexpr float kWhole = 0x1.010102p118f;       // 2^126 / 255, the light of a pixel before the first splat
    struct alignas(16) Lit {
        float slope_x, slope_y, u0, slope, v0, log_opacity, color[3]; // log_opacity: log2(opacity / kWhole)
    };
    static_assert(sizeof(Lit) == 48);

    static __device__ __forceinline__ bool takesLight(float T, float least) { return T >= least; }

    static __device__ __forceinline__ float logOpacity(const Splat& s)
    {
        return __log2f(stepsOf(*reinterpret_cast<const uint32_t*>(&s.color[2])).y);
    }

    // Prepares a splat for the bin whose first pixel is (x0, y0). No operation is contracted: two instances of this
    // code blend bins, and must agree to the last bit.
    static __device__ __forceinline__ Lit light(const Splat& s, const BlendCudaArgs& args, float x0, float y0)
    {
        const float2 rg = stepsOf(*reinterpret_cast<const uint32_t*>(&s.color[0]));
        const float2 bo = stepsOf(*reinterpret_cast<const uint32_t*>(&s.color[2]));
        const float x = __fsub_rn(s.x, x0), y = __fsub_rn(s.y, y0);
        return {s.factor[0],
                s.factor[1],
                -fmaf(s.factor[0], x, __fmul_rn(s.factor[1], y)),
                s.factor[2],
                -__fmul_rn(s.factor[2], y),
                __fsub_rn(__log2f(bo.y), kWholeLog2),
                {__fsub_rn(rg.x, args.background[0]), __fsub_rn(rg.y, args.background[1]),
                 __fsub_rn(bo.x, args.background[2])}};
    }

    static __device__ __forceinline__ Bounds bounds(const Splat& s)
    {
        constexpr float kLog255 = 7.99435343685886f;
        const float a = s.factor[0], b = s.factor[1], c = s.factor[2], yy = b * b + c * c;
        // also for a matrix that is no ellipse, which the trainers' code draws all the same
        if (!(c * c > kTrustedDeterminant * yy && a > 0.0f))
            return unbounded();
        return boundsOf(a * a, a * b, yy, a * c * (a * c), logOpacity(s) + kLog255 + 4e-3f);
    }

    // Pixels in which the splat may be drawn. The radius is computed anew, from the inverse of the covariance. Needles
    // are drawn wherever their ellipse reaches. No operation is contracted, as in light().
    static __device__ __forceinline__ PixelBox box(const Splat& s, const RasterConstants& rules)
    {
        constexpr float kTwoLn2 = 1.38629436111989f;
        const float cc = __fmul_rn(s.factor[2], s.factor[2]);
        const float yy = __fadd_rn(__fmul_rn(s.factor[1], s.factor[1]), cc), xx = __fmul_rn(s.factor[0], s.factor[0]);
        if (!(cc > __fmul_rn(kTrustedDeterminant, yy)))
            return {-INFINITY, -INFINITY, INFINITY, INFINITY};
        const float inv = __fdividef(1.0f, __fmul_rn(kTwoLn2, __fmul_rn(xx, cc)));
        const float mid = __fmul_rn(__fmul_rn(0.5f, __fadd_rn(xx, yy)), inv);
        const float rest = __fsub_rn(__fmul_rn(mid, mid), __fmul_rn(inv, 1.0f / kTwoLn2));
        const float lambda = __fadd_rn(mid, sqrtf(fmaxf(rules.eigen_floor, rest)));
        const float r = ceilf(__fmul_rn(3.0f, sqrtf(lambda)));
        constexpr float kTile = kTileSize;
        if (rules.gsplat)
            return {floorf((s.x + 0.5f - r) / kTile) * kTile, floorf((s.y + 0.5f - r) / kTile) * kTile,
                    ceilf((s.x + 0.5f + r) / kTile) * kTile - 1.0f, ceilf((s.y + 0.5f + r) / kTile) * kTile - 1.0f};
        return {floorf((s.x - r) / kTile) * kTile, floorf((s.y - r) / kTile) * kTile,
                floorf((s.x + r + kTile - 1.0f) / kTile) * kTile - 1.0f,
                floorf((s.y + r + kTile - 1.0f) / kTile) * kTile - 1.0f};
    }

    // Falloff of a splat at pixel (px, py), divided by kWhole, before alpha is capped.
    static __device__ __forceinline__ float falloff(const Lit& s, float px, float py)
    {
        const float u = fmaf(s.slope_x, px, fmaf(s.slope_y, py, s.u0)), v = fmaf(s.slope, py, s.v0);
        return exp2Approx(fmaf(-u, u, fmaf(-v, v, s.log_opacity)));
    }

    static __device__ __forceinline__ float alpha(const Lit& s, const BlendCudaArgs& args, float px, float py)
    {
        return fminf(args.rules.alpha_cap, kWhole * falloff(s, px, py));
    }

    // Light behind a splat, where light is counted from 1 (DepthRules).
    static __device__ __forceinline__ float behind(float T, float alpha) { return __fsub_rn(T, __fmul_rn(alpha, T)); }

    // Light behind a splat at pixel (px, py), computed as blend() does.
    static __device__ __forceinline__ float pass(const Lit& s, const BlendCudaArgs& args, float px, float py, float T)
    {
        return fmaf(-kWhole, __fmul_rn(fminf(args.lifted_cap, falloff(s, px, py)), T), T);
    }

    // Arguments of a launch: `args` with cap and bound converted to the units of these rules.
    static BlendCudaArgs lifted(BlendCudaArgs args)
    {
        args.lifted_cap = args.rules.alpha_cap / kWhole;
        args.lifted_stop = args.rules.stop * kWhole;
        return args;
    }

    // Blends four splats, in a row and without a branch, into two pixels of a row: the falloffs do not wait for each
    // other, only the light does. No operation is contracted: two instances of this code blend bins, and must agree to
    // the last bit.
    static __device__ __forceinline__ void blend(const Lit* const (&splats)[4], const BlendCudaArgs& args,
                                                 const PixelPair& at, const float (&least)[2], float (&T)[2],
                                                 float (&color)[2][3])
    {
        float alphas[4][2];
#pragma unroll
        for (uint32_t i = 0; i < 4; ++i)
#pragma unroll
            for (uint32_t p = 0; p < 2; ++p)
                alphas[i][p] = fminf(args.lifted_cap, falloff(*splats[i], at.x[p], at.y));
#pragma unroll
        for (uint32_t i = 0; i < 4; ++i)
#pragma unroll
            for (uint32_t p = 0; p < 2; ++p) {
                const float weight = __fmul_rn(alphas[i][p], T[p]);
                T[p] = fmaf(-kWhole, weight, T[p]);
                // the splat that would bring the light below the bound is not drawn
                addColorWhere(T[p], least[p], weight, splats[i]->color, color[p]);
            }
    }

    // A splat that draws nothing anywhere.
    static __device__ __forceinline__ Lit nothing()
    {
        return {0, 0, 0, 0, 0, -INFINITY, {0, 0, 0}};
    }
};

// Rules of tier `exact`, in the trainers' arithmetic. kGsplat: value of RasterConstants::gsplat.
template <bool kGsplat>
struct ExactRules {
    using Splat = ExactSplat;
    static constexpr bool kDepth = false;
    static constexpr bool kInBin = false, kCodes = false, kOnBackground = false, kSegments = false;
    static constexpr uint32_t kLoneBlocks = 8;
    static constexpr float kWhole = 1.0f;
    struct alignas(16) Lit {
        // half_a, half_c: halves of the conic's a and c, negated; halving is exact
        float x, y, half_a, b, half_c, opacity, color[3];
    };

    static __device__ __forceinline__ bool takesLight(float T, float) { return T > 0.0f; }

    static __device__ __forceinline__ Lit light(const Splat& s, const BlendCudaArgs&, float, float)
    {
        return {s.x,
                s.y,
                -0.5f * s.conic[0],
                s.conic[1],
                -0.5f * s.conic[2],
                s.opacity,
                {s.color[0], s.color[1], s.color[2]}};
    }

    static __device__ __forceinline__ Bounds bounds(const Splat& s)
    {
        const float a = s.conic[0], b = s.conic[1], c = s.conic[2], det = a * c - b * b;
        // thin ellipses have an inexact determinant, which is a difference; others are no ellipse at all, which the
        // trainers' code draws all the same
        if (!(det > 1e-3f * a * c && a > 0.0f && c > 0.0f))
            return unbounded();
        return boundsOf(a, b, c, det, 2.0f * __logf(255.0f * s.opacity) + 4e-3f);
    }

    static __device__ __forceinline__ PixelBox box(const Splat& s, const RasterConstants&)
    {
        constexpr float kTile = kTileSize;
        return {float(s.tx0) * kTile, float(s.ty0) * kTile, float(s.tx1) * kTile - 1.0f, float(s.ty1) * kTile - 1.0f};
    }

    static __device__ __forceinline__ float alphaOf(const Lit& s, const BlendCudaArgs& args, float px, float py,
                                                    bool gsplat)
    {
        const float dx = s.x - px, dy = s.y - py, b_dx = s.b * dx;
        const float squares = fmaf(dx, s.half_a * dx, dy * (s.half_c * dy));
        const float power = gsplat ? fmaf(-b_dx, dy, squares) : squares - dy * b_dx;
        const float a = minNumber(args.rules.alpha_cap, s.opacity * expf(power));
        return power > 0.0f || a < kOpacityFloor ? 0.0f : a;
    }

    static __device__ __forceinline__ float alpha(const Lit& s, const BlendCudaArgs& args, float px, float py)
    {
        return alphaOf(s, args, px, py, kGsplat);
    }

    static __device__ __forceinline__ float behind(float T, float alpha) { return T * (1.0f - alpha); }

    // Does blendStep() for four splats in a row without a branch, with equal bits. A splat that is not drawn has alpha
    // zero, which adds nothing and keeps the transmittance; that of a finished pixel is negative, below the bound.
    static __device__ __forceinline__ void blend(const Lit* const (&splats)[4], const BlendCudaArgs& args,
                                                 const PixelPair& at, const float (&)[2], float (&T)[2],
                                                 float (&color)[2][3])
    {
#pragma unroll
        for (uint32_t p = 0; p < 2; ++p) {
            float alphas[4];
#pragma unroll
            for (uint32_t i = 0; i < 4; ++i)
                alphas[i] = alpha(*splats[i], args, at.x[p], at.y);
#pragma unroll
            for (uint32_t i = 0; i < 4; ++i) {
                const float next = behind(T[p], alphas[i]);
                const bool drawn = kGsplat ? next > args.rules.stop : next >= args.rules.stop;
                const float a = drawn ? alphas[i] : 0.0f;
                for (int c = 0; c < 3; ++c)
                    color[p][c] = kGsplat ? fmaf(T[p] * a, splats[i]->color[c], color[p][c])
                                          : fmaf(T[p], a * splats[i]->color[c], color[p][c]);
                T[p] = drawn ? next : finished(T[p]); // the Gaussian that takes the light below the bound is not drawn
            }
        }
    }

    // A splat with opacity zero.
    static __device__ __forceinline__ Lit nothing()
    {
        return {};
    }
};

// Rules of tier `exact` for models with and without gsplat, in a kernel seldom used, so two are not worth compiling.
struct AnyExactRules : ExactRules<false> {
    static __device__ __forceinline__ float alpha(const Lit& s, const BlendCudaArgs& args, float px, float py)
    {
        return alphaOf(s, args, px, py, args.rules.gsplat);
    }

    // Light behind a splat at pixel (px, py), computed as blend() does.
    static __device__ __forceinline__ float pass(const Lit& s, const BlendCudaArgs& args, float px, float py, float T)
    {
        const float next = behind(T, alpha(s, args, px, py));
        return (args.rules.gsplat ? next > args.rules.stop : next >= args.rules.stop) ? next : finished(T);
    }
};

// Finds the depth of a pixel (FrameTarget::depth) instead of its colour. color[0] is the depth of the splat; a pixel
// that has a depth is finished. A depth is found when half of the light is left, far above the bound at which light
// ends, so these rules ignore the bound.
template <typename Base>
struct DepthRules : Base {
    static constexpr bool kDepth = true, kSegments = false;
    static constexpr float kWhole = 1.0f; // light is counted from 1; that of a finished pixel is marked by its sign

    static __device__ __forceinline__ bool takesLight(float T, float) { return T > 0.0f; }

    static __device__ __forceinline__ void blend(const typename Base::Lit* const (&splats)[4],
                                                 const BlendCudaArgs& args, const PixelPair& at, const float (&)[2],
                                                 float (&T)[2], float (&color)[2][3])
    {
#pragma unroll
        for (uint32_t p = 0; p < 2; ++p)
#pragma unroll
            for (uint32_t i = 0; i < 4; ++i) {
                const float next = Base::behind(T[p], Base::alpha(*splats[i], args, at.x[p], at.y));
                const bool goes_on = next >= kHalfLight;
                color[p][0] = !goes_on && T[p] > 0.0f ? splats[i]->color[0] : color[p][0];
                T[p] = goes_on ? next : finished(T[p]);
            }
    }
};

// Counts in color[0] the splats that are evaluated for a pixel. As in the picture, a finished pixel counts on until all
// pixels of its sub-tile are finished; what fills up four splats does not count.
template <typename Base>
struct CostRules : Base {
    static constexpr bool kSegments = false; // off, so that counts are those of a list that is not cut

    static __device__ __forceinline__ typename Base::Lit light(const typename Base::Splat& s, const BlendCudaArgs& args,
                                                               float x0, float y0)
    {
        typename Base::Lit lit = Base::light(s, args, x0, y0);
        lit.color[0] = 1.0f; // 1 for each splat; nothing() has 0
        return lit;
    }

    static __device__ __forceinline__ void blend(const typename Base::Lit* const (&splats)[4],
                                                 const BlendCudaArgs& args, const PixelPair& at, const float (&)[2],
                                                 float (&T)[2], float (&color)[2][3])
    {
#pragma unroll
        for (uint32_t p = 0; p < 2; ++p)
#pragma unroll
            for (uint32_t i = 0; i < 4; ++i) {
                color[p][0] += splats[i]->color[0];
                T[p] = Base::pass(*splats[i], args, at.x[p], at.y, T[p]);
            }
    }
};

} // namespace gsc
