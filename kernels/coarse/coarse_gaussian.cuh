// SPDX-License-Identifier: Apache-2.0
// Packs and unpacks Gaussians of coarse copies (CoarsePage).
#pragma once

#include "kernels/coarse/coarse_cuda.h"
#include "kernels/cuda/halves.cuh"

namespace gsc {

// Units in which a group's copy is packed: origin and step of positions, and unit of factors.
struct CoarseFrame {
    float origin[3];
    float step; // step of positions in world units
    float cell;
};

constexpr float kPlaceSteps = float((1u << 21) - 1);

__device__ __forceinline__ CoarseFrame coarseFrame(const GroupRecord& group, const CoarseCell& cell)
{
    CoarseFrame frame;
    float extent = 0.0f;
#pragma unroll
    for (int i = 0; i < 3; ++i) {
        frame.origin[i] = group.gaussian_min[i];
        extent = fmaxf(extent, group.gaussian_max[i] - group.gaussian_min[i]);
    }
    frame.step = extent * (1.0f / kPlaceSteps);
    frame.cell = exp2f(float(cellExponent(cell.edge)));
    return frame;
}

struct CoarseGaussian {
    float position[3], factor[6], color[3], opacity; // factor: L00 L10 L20 L11 L21 L22 of L L^T, world units
    uint32_t order;
};

// Cholesky factor of a covariance c (xx xy xz yy yz zz), which is positive definite but for rounding. least: lower
// bound of the diagonal of the factor.
__device__ __forceinline__ void factorOf(const float* c, float least, float* factor)
{
    const float l00 = sqrtf(fmaxf(c[0], least * least)), inverse0 = __fdividef(1.0f, l00);
    const float l10 = c[1] * inverse0, l20 = c[2] * inverse0;
    const float l11 = sqrtf(fmaxf(c[3] - l10 * l10, least * least));
    const float l21 = __fdividef(c[4] - l20 * l10, l11);
    const float l22 = sqrtf(fmaxf(c[5] - l20 * l20 - l21 * l21, least * least));
    factor[0] = l00;
    factor[1] = l10;
    factor[2] = l20;
    factor[3] = l11;
    factor[4] = l21;
    factor[5] = l22;
}

// Cholesky factor, row by row, from a rotation (row-major) and standard deviations. It is not computed from the
// covariance, in which the thin axes of a long Gaussian would be lost by rounding.
__device__ __forceinline__ void factorOf(const float (&rotation)[9], const float* sigma, float* factor)
{
    float rows[3][3], units[2][3] = {};
#pragma unroll
    for (int i = 0; i < 3; ++i)
#pragma unroll
        for (int k = 0; k < 3; ++k)
            rows[i][k] = rotation[3 * i + k] * sigma[k];
    const auto dot = [](const float* a, const float* b) { return fmaf(a[0], b[0], fmaf(a[1], b[1], a[2] * b[2])); };
    const auto unit = [&](const float* row, float* to) {
        const float square = fmaxf(dot(row, row), 1e-30f), inverse = rsqrtf(square);
        for (int k = 0; k < 3; ++k)
            to[k] = row[k] * inverse;
        return square * inverse;
    };
    const auto take = [&](float* row, const float* from) {
        const float along = dot(row, from);
        for (int k = 0; k < 3; ++k)
            row[k] = fmaf(-along, from[k], row[k]);
        return along;
    };
    factor[0] = unit(rows[0], units[0]);
    factor[1] = take(rows[1], units[0]);
    factor[2] = take(rows[2], units[0]);
    factor[3] = unit(rows[1], units[1]);
    factor[4] = take(rows[2], units[1]);
    factor[5] = sqrtf(dot(rows[2], rows[2]));
}

__device__ __forceinline__ void storeCoarse(CoarsePage& page, uint32_t at, const CoarseFrame& frame,
                                            const CoarseGaussian& gaussian)
{
    uint32_t place[3];
    const float per_step = frame.step > 0.0f ? __fdividef(1.0f, frame.step) : 0.0f;
#pragma unroll
    for (int i = 0; i < 3; ++i)
        place[i] = uint32_t(
            __float2int_rn(fminf(fmaxf((gaussian.position[i] - frame.origin[i]) * per_step, 0.0f), kPlaceSteps)));
    const float unit = __fdividef(1.0f, frame.cell);
    const auto halves = [&](uint32_t low, uint32_t high) {
        return packHalves(fminf(fmaxf(gaussian.factor[low] * unit, -6e4f), 6e4f),
                          fminf(fmaxf(gaussian.factor[high] * unit, -6e4f), 6e4f));
    };
    page.first[at] = {{place[0] | place[1] << 21, place[1] >> 11 | place[2] << 10, halves(0, 1), halves(2, 3)}};
    page.second[at] = {{halves(4, 5), packSteps(gaussian.color[0], gaussian.color[1]),
                        packSteps(gaussian.color[2], gaussian.opacity), gaussian.order}};
}

__device__ __forceinline__ CoarseGaussian loadCoarse(const CoarsePage& page, uint32_t at, const CoarseFrame& frame)
{
    const uint4 a = reinterpret_cast<const uint4*>(page.first)[at], b = reinterpret_cast<const uint4*>(page.second)[at];
    constexpr uint32_t kMask = (1u << 21) - 1;
    const uint32_t place[3] = {a.x & kMask, (a.x >> 21 | a.y << 11) & kMask, a.y >> 10 & kMask};
    CoarseGaussian gaussian;
#pragma unroll
    for (int i = 0; i < 3; ++i)
        gaussian.position[i] = fmaf(float(place[i]), frame.step, frame.origin[i]);
    const float2 f01 = halvesOf(a.z), f23 = halvesOf(a.w), f45 = halvesOf(b.x), rg = stepsOf(b.y), bo = stepsOf(b.z);
    const float factor[6] = {f01.x, f01.y, f23.x, f23.y, f45.x, f45.y};
#pragma unroll
    for (int i = 0; i < 6; ++i)
        gaussian.factor[i] = factor[i] * frame.cell;
    gaussian.color[0] = rg.x;
    gaussian.color[1] = rg.y;
    gaussian.color[2] = bo.x;
    gaussian.opacity = bo.y;
    gaussian.order = b.w;
    return gaussian;
}

} // namespace gsc
