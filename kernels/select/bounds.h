// SPDX-License-Identifier: Apache-2.0
// Tests of a box of anchors against an eye: they reject a box only if testAnchor() is false for every anchor in it.
#pragma once

#include "kernels/math/band.h"
#include "kernels/math/lod.h"

#include <cmath>

namespace gsc {

struct EyeBounds {
    BoundPlane planes[5]; // planes of the near limit, left, right, top and bottom
    float center[3];
    // all that the choice of levels depends on except the distance, see rejectsLevel()
    float lod_bias, lod_fade;
};

// Planes for all anchors whose ellipsoid has no standard deviation above sigma. With t the point in view space, the
// radius of format facts 7.3 is at most 3 sqrt(sigma^2 G / z^2 + 0.62) + 1 <= 3 sigma sqrt(G) / z + 3.5. G bounds the
// square of the Jacobian, whose slope is clamped at 1.3 tan from the image's middle. The trainers' code drops the
// anchor if X + r < 1 or X - r >= 16 grid. Multiplied by z > 0, both conditions are linear in the point.
GSC_HD EyeBounds eyeBounds(const EyeParams& eye, const RasterConstants& rules, float lod_bias, float lod_fade)
{
    EyeBounds bounds{};
    const float* w = eye.world_to_view;
    for (int i = 0; i < 3; ++i)
        bounds.center[i] = eye.center[i];
    const float tan[2] = {eye.tan_fov_x, eye.tan_fov_y}, focal[2] = {eye.focal_x, eye.focal_y};
    const float tan_mid[2] = {eye.tan_mid_x, eye.tan_mid_y};
    const uint32_t size[2] = {eye.width, eye.height};
    float jacobian = 0;
    for (int axis = 0; axis < 2; ++axis) {
        const float limit = std::fabs(tan_mid[axis]) + 1.304f * tan[axis];
        jacobian += focal[axis] * focal[axis] * (1 + limit * limit);
    }
    const float reach = 3.001f * std::sqrt(jacobian * viewStretch(w));
    for (int i = 0; i < 3; ++i)
        bounds.planes[0].n[i] = w[8 + i];
    bounds.planes[0].offset = w[11] - rules.near_z * 0.9999f;
    for (int axis = 0; axis < 2; ++axis) {
        const float low = rules.gsplat ? -0.5f : 1.0f;
        const float high = rules.gsplat ? float(size[axis]) - 0.5f : float(tileCount(size[axis]) * kTileSize);
        bounds.planes[1 + 2 * axis] = borderPlane(eye, axis, true, low, 3.5f, reach);
        bounds.planes[2 + 2 * axis] = borderPlane(eye, axis, false, high, 3.5f, reach);
    }
    bounds.lod_bias = lod_bias;
    bounds.lod_fade = lod_fade;
    return bounds;
}

GSC_HD bool rejectsBox(const EyeBounds& eye, const float* box_min, const float* box_max, float sigma)
{
    for (const BoundPlane& plane : eye.planes)
        if (rejects(plane, box_min, box_max, sigma))
            return true;
    return false;
}

// Returns true if every anchor in the box has a finer level than the one chosen at the nearest point of the box.
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
