// SPDX-License-Identifier: Apache-2.0
// Conservative tests of a box of anchors against an eye: true only if testAnchor() is false for every anchor inside.
#pragma once

#include "kernels/math/eye.h"
#include "kernels/math/lod.h"

#include <cmath>

namespace gsc {

// A half-space in world coordinates: nothing is visible where n p + offset + sigma_factor * sigma < 0.
struct BoundPlane {
    float n[3];
    float offset;
    float sigma_factor; // times the largest standard deviation of an anchor
};

struct EyeBounds {
    BoundPlane planes[5]; // near, left, right, top, bottom
    float center[3];
    // Everything about LOD but the distance, see rejectsLevel().
    float lod_bias, lod_fade;
};

// Planes that hold for any anchor whose ellipsoid has no standard deviation above sigma. With t the view-space
// point, the radius of 7.3 is at most 3 sqrt(sigma^2 G / z^2 + 0.62) + 1 <= 3 sigma sqrt(G) / z + 3.5 (G bounds the
// squared Jacobian, whose slope is clamped 1.3 tan from the image's middle), and upstream drops the anchor if X + r < 1 or X - r >= 16 grid.
// Multiplied by z > 0 both are linear in the point.
GSC_HD EyeBounds eyeBounds(const EyeParams& eye, const RasterConstants& rules, float lod_bias, float lod_fade)
{
    EyeBounds bounds{};
    const float* w = eye.world_to_view;
    float stretch = 1; // squared bound of what a view matrix that is no pure rotation does to lengths
    for (int i = 0; i < 3; ++i) {
        float sum = 0;
        for (int j = 0; j < 3; ++j)
            sum += std::fabs(w[4 * i] * w[4 * j] + w[4 * i + 1] * w[4 * j + 1] + w[4 * i + 2] * w[4 * j + 2]);
        stretch = maxNumber(stretch, sum);
        bounds.center[i] = eye.center[i];
    }
    const float tan[2] = {eye.tan_fov_x, eye.tan_fov_y}, focal[2] = {eye.focal_x, eye.focal_y};
    const float tan_mid[2] = {eye.tan_mid_x, eye.tan_mid_y};
    const uint32_t size[2] = {eye.width, eye.height};
    float jacobian = 0;
    for (int axis = 0; axis < 2; ++axis) {
        const float limit = std::fabs(tan_mid[axis]) + 1.304f * tan[axis];
        jacobian += focal[axis] * focal[axis] * (1 + limit * limit);
    }
    const float reach = 3.001f * std::sqrt(jacobian * stretch);
    for (int i = 0; i < 3; ++i)
        bounds.planes[0].n[i] = w[8 + i];
    bounds.planes[0].offset = w[11] - rules.near_z * 0.9999f;
    for (int axis = 0; axis < 2; ++axis) {
        const float middle = 0.5f * (float(size[axis]) - 1);
        const float low = rules.gsplat ? -0.5f : 1.0f;
        const float high = rules.gsplat ? float(size[axis]) - 0.5f : float(tileCount(size[axis]) * kTileSize);
        const float off = focal[axis] * tan_mid[axis]; // pixels from the eye's axis to the image's middle
        const float slope[2] = {middle - low + 3.5f - off, high - middle + 3.5f + off};
        for (int side = 0; side < 2; ++side) {
            BoundPlane& plane = bounds.planes[1 + 2 * axis + side];
            const float sign = side == 0 ? focal[axis] : -focal[axis];
            for (int i = 0; i < 3; ++i)
                plane.n[i] = sign * w[4 * axis + i] + slope[side] * w[8 + i];
            plane.offset = sign * w[4 * axis + 3] + slope[side] * w[11];
            plane.sigma_factor = reach;
        }
    }
    bounds.lod_bias = lod_bias;
    bounds.lod_fade = lod_fade;
    return bounds;
}

// note: written so that NaN rejects nothing
GSC_HD bool rejectsBox(const EyeBounds& eye, const float* box_min, const float* box_max, float sigma)
{
    for (const BoundPlane& plane : eye.planes) {
        float value = plane.offset + plane.sigma_factor * sigma;
        float magnitude = std::fabs(plane.offset) + plane.sigma_factor * sigma;
        for (int i = 0; i < 3; ++i) {
            const float corner = plane.n[i] > 0 ? box_max[i] : box_min[i];
            value += plane.n[i] * corner;
            magnitude += std::fabs(plane.n[i] * corner);
        }
        if (value + 1e-5f * magnitude < 0)
            return true;
    }
    return false;
}

// Whether every anchor of the box lies on a finer level than is chosen at its nearest point.
GSC_HD bool rejectsLevel(const ModelParams& params, const EyeBounds& eye, int32_t level, const float* box_min,
                         const float* box_max, float extra_max)
{
    if (!(params.flags & kModelHasLevels) || params.level_rule == uint32_t(LevelRule::None) || level <= 0)
        return false;
    const float shift = lodShift<float>(params, level);
    float squared = 0, magnitude = 0;
    for (int i = 0; i < 3; ++i) {
        const float low = box_min[i] + shift, high = box_max[i] + shift, c = eye.center[i];
        const float gap = maxNumber(0.0f, maxNumber(low - c, c - high));
        squared += gap * gap;
        magnitude = maxNumber(magnitude, maxNumber(std::fabs(low), maxNumber(std::fabs(high), std::fabs(c))));
    }
    const float nearest = std::sqrt(squared) * 0.99999f - 1e-6f * magnitude;
    if (!(nearest > 0))
        return false;
    float finest = std::log2(params.standard_dist / (nearest * params.lod_scale));
    if (params.fork != 2)
        finest /= std::log2(float(params.fork));
    finest += extra_max + eye.lod_bias + 1e-3f;
    return level > chooseLevel(LevelRule(params.level_rule), finest, params.level_clamp, eye.lod_fade).level;
}

} // namespace gsc
