// SPDX-License-Identifier: Apache-2.0
// Projects in the tier `fast`: turns a decoded Gaussian into the splat that blending reads.
#pragma once

#include "kernels/cuda/halves.cuh"
#include "kernels/decode/fast/decode_fast_cuda.h"
#include "kernels/math/foveation.h"
#include "kernels/math/projection.h"

namespace gsc {

struct Candidate {
    uint4 words[2]; // a PackedSplat, as words, so that it stays in registers
    SplatPlace place;
    uint32_t touch; // touchCode() of the splat
};

// Rotation matrix, row-major, of a quaternion of length sqrt(2).
__device__ __forceinline__ void rotationOf(const float* quaternion, float (&r)[9])
{
    const float qw = quaternion[0], qx = quaternion[1], qy = quaternion[2], qz = quaternion[3];
    r[0] = 1 - (qy * qy + qz * qz);
    r[1] = qx * qy - qw * qz;
    r[2] = qx * qz + qw * qy;
    r[3] = qx * qy + qw * qz;
    r[4] = 1 - (qx * qx + qz * qz);
    r[5] = qy * qz - qw * qx;
    r[6] = qx * qz - qw * qy;
    r[7] = qy * qz + qw * qx;
    r[8] = 1 - (qx * qx + qy * qy);
}

// Projects one Gaussian. Returns false if it cannot change a pixel of the columns that are drawn. root(u, v, uu, uv,
// vv): multiplies the columns of a root of the covariance (world units) with two vectors, and adds up squares and
// products of the results. finite: set to true if the Gaussian can be projected, or lies outside of the depths that are
// drawn. kThins: as in DecodeFrame. note: no early return, and & in place of &&: nearly every Gaussian goes all the
// way, and a branch costs more than it saves
template <bool kThins, typename Root>
__device__ __forceinline__ bool projectRoot(const DecodeCudaArgs& args, uint32_t e, const float* position,
                                            const Root& root, float opacity, const float* color, uint32_t order,
                                            Candidate& out, bool& finite)
{
    const EyeParams& eye = args.eyes[e];
    const Vec3<float> p{position[0], position[1], position[2]};
    const Vec3<float> t = viewPoint<float>(eye, p);
    const bool outside = t.z <= args.rules.near_z || t.z > args.rules.far_z;
    const float inv_z = __fdividef(1.0f, t.z);
    const EyeLens& lens = args.lenses[e];
    const float ux = t.x * inv_z, uy = t.y * inv_z;
    const float x = fmaf(eye.focal_x, ux, lens.middle[0]), y = fmaf(eye.focal_y, uy, lens.middle[1]);
    const float tx = fminf(lens.most[0], fmaxf(lens.least[0], ux)), ty = fminf(lens.most[1], fmaxf(lens.least[1], uy));
    const float fx = eye.focal_x * inv_z, fy = eye.focal_y * inv_z;
    const float* w = eye.world_to_view;
    float ju[3], jv[3]; // rows of J R (projection times rotation) without the factors fx and fy
#pragma unroll
    for (int i = 0; i < 3; ++i) {
        ju[i] = w[i] - tx * w[8 + i];
        jv[i] = w[4 + i] - ty * w[8 + i];
    }
    float uu = 0.0f, uv = 0.0f, vv = 0.0f;
    root(ju, jv, uu, uv, vv);
    float a = fmaf(fx * fx, uu, 0.3f), b = fx * fy * uv, c = fmaf(fy * fy, vv, 0.3f);
    float det = a * c - b * b;
    bool drawn = !outside & (det > 0.0f);
    if constexpr (kThins) {
        const float* gaze = args.gaze[e];
        const float cosine =
            __fdividef(fmaf(ux, gaze[0], fmaf(uy, gaze[1], gaze[2])), sqrtf(fmaf(ux, ux, fmaf(uy, uy, 1.0f))));
        const float wanted = finestVariance(cosine, args.finest);
        const float has = sqrtf(fmaxf(det, 0.0f)); // geometric mean of the variances along both axes
        if (drawn && has < wanted) {
            drawn = foveationRank(order) < __fdividef(has, wanted); // the probability with which the splat is drawn
            const float grows = __fdividef(wanted, has);
            a *= grows;
            b *= grows;
            c *= grows;
            det *= grows * grows;
        }
    }

    // pixels of the box of the ellipse on which alpha reaches 1/255, cut by upstream's 3-sigma tiles
    const float reach = 2.0f * __logf(255.0f * opacity) + 5e-3f; // squared Mahalanobis distance; an
    // opacity near 1/255 is rounded by up to half of one of 257 steps when it is packed
    const float ex = sqrtf(reach * a) + 0.01f, ey = sqrtf(reach * c) + 0.01f;
    float x0 = x - ex, y0 = y - ey, x1 = x + ex, y1 = y + ey;
    const float mid = 0.5f * (a + c);
    const float axis = sqrtf(mid + sqrtf(fmaxf(args.rules.eigen_floor, mid * mid - det)));
    // cuts only large splats: the square of a smaller one ends at most 3 pixels before its ellipse
    if (fmaxf(ex, ey) >= float(kTileSize)) {
        const float radius = ceilf(3.0f * axis);
        x0 = fmaxf(x0, floorf((x - radius) * (1.0f / kTileSize)) * kTileSize);
        y0 = fmaxf(y0, floorf((y - radius) * (1.0f / kTileSize)) * kTileSize);
        x1 = fminf(x1, ceilf((x + radius) * (1.0f / kTileSize)) * kTileSize + kTileSize - 1.0f);
        y1 = fminf(y1, ceilf((y + radius) * (1.0f / kTileSize)) * kTileSize + kTileSize - 1.0f);
    }
    const float left = args.bands[e].first, right = args.bands[e].last, bottom = float(eye.height) - 1.0f;
    drawn =
        drawn & (x1 >= left) & (y1 >= 0.0f) & (x0 <= right) & (y0 <= bottom) & (ceilf(x0) <= x1) & (ceilf(y0) <= y1);
    finite = drawn | outside | ((det == det) & (x == x) & (y == y));
    // whole pixels in the low bits, as in packSteps(), rounded down
    const auto whole = [](float pixel) { return __float_as_uint(__fadd_rz(pixel, 0x1p23f)); };
    const uint32_t left0 = whole(ceilf(fmaxf(x0, left))), top0 = whole(ceilf(fmaxf(y0, 0.0f)));
    const uint32_t right1 = whole(fmaxf(fminf(x1, right), 0.0f)), bottom1 = whole(fmaxf(fminf(y1, bottom), 0.0f));
    const uint32_t row_bits = args.grid.height == 16 ? 4u : 5u;
    const uint32_t from = __byte_perm(left0 / kBinWidth, top0 >> row_bits, 0x0040),
                   to = __byte_perm(right1 / kBinWidth, bottom1 >> row_bits, 0x0040);
    // The square of the trainers' code is no smaller than this one. Its tiles cut nothing from a box within it, except
    // a last pixel that is less than one pixel before the end of the square and the first of a tile.
    const float square = ceilf(2.999f * axis);
    const auto isCut = [square](uint32_t last, float middle) {
        return (last % kTileSize == 0) & (__uint_as_float(last) - 0x1p23f + 1.001f > middle + square);
    };
    const bool boxed = (fmaxf(ex, ey) <= fminf(square, kTouchReach)) & !isCut(right1, x) & !isCut(bottom1, y);
    out.touch =
        boxed ? touchCode(left0 / kTouchColumn, right1 / kTouchColumn - left0 / kTouchColumn, top0, bottom1 - top0)
              : kTouchUnknown;
    // root of the inverse of the covariance, by Cholesky. The second pivot is 1 / c, whatever rounding left of the
    // determinant
    constexpr float kRoot = 0.849321800288019f; // square root of log2(e) / 2
    const float inv_root_c = rsqrtf(c);
    const float along = kRoot * (c * inv_root_c) * rsqrtf(det), across = -b * (inv_root_c * inv_root_c) * along;
    out.words[0] = {__float_as_uint(x), __float_as_uint(y), __float_as_uint(along), __float_as_uint(across)};
    out.words[1] = {__float_as_uint(kRoot * inv_root_c), packSteps(color[0], color[1]), packSteps(color[2], opacity),
                    order};
    out.place = {__float_as_uint(t.z), __byte_perm(from, to, 0x5410)};
    return drawn;
}

// Projects, as projectRoot() does, a Gaussian with the scale `sigma` (world units) and a rotation. quaternion: of
// length sqrt(2), which saves the factors 2 in its matrix.
template <bool kThins>
__device__ __forceinline__ bool projectFast(const DecodeCudaArgs& args, uint32_t e, const float* position,
                                            const float* sigma, const float* quaternion, float opacity,
                                            const float* color, uint32_t order, Candidate& out, bool& finite)
{
    const auto root = [&](const float* ju, const float* jv, float& uu, float& uv, float& vv) {
        float r[9];
        rotationOf(quaternion, r);
#pragma unroll
        for (int j = 0; j < 3; ++j) {
            const float pu = sigma[j] * (ju[0] * r[j] + ju[1] * r[3 + j] + ju[2] * r[6 + j]);
            const float pv = sigma[j] * (jv[0] * r[j] + jv[1] * r[3 + j] + jv[2] * r[6 + j]);
            uu = fmaf(pu, pu, uu);
            uv = fmaf(pu, pv, uv);
            vv = fmaf(pv, pv, vv);
        }
    };
    return projectRoot<kThins>(args, e, position, root, opacity, color, order, out, finite);
}

} // namespace gsc
