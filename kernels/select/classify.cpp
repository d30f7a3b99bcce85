// SPDX-License-Identifier: Apache-2.0
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/select/classify.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "kernels/simd/simd_math-inl.h"
#include "kernels/select/classify.h"

HWY_BEFORE_NAMESPACE();
namespace gsc {
namespace HWY_NAMESPACE {

// Value of a plane at points, and `magnitude`, the sum of the magnitudes of its terms.
HWY_INLINE V planeValue(D d, const BoundPlane& plane, V x, V y, V z, V sigma, V& magnitude)
{
    const V px = hn::Mul(hn::Set(d, plane.n[0]), x), py = hn::Mul(hn::Set(d, plane.n[1]), y);
    const V pz = hn::Mul(hn::Set(d, plane.n[2]), z), reach = hn::Mul(hn::Set(d, plane.sigma_factor), sigma);
    const V offset = hn::Set(d, plane.offset);
    magnitude = hn::Add(hn::Add(hn::Abs(px), hn::Abs(py)), hn::Add(hn::Abs(pz), hn::Add(hn::Abs(offset), reach)));
    return hn::Add(hn::Add(hn::Add(px, py), hn::Add(pz, offset)), reach);
}

// note: each comparison is false for NaN, so that the exact test decides about the anchor
void classify(const EyeClassifier& eye, const LodClassifier& lod, const GroupLanes& lanes, Classes& classes)
{
    const D d;
    const V zero = hn::Zero(d), slack = hn::Set(d, kPlaneSlack);
    const auto never = hn::Lt(zero, zero);
    for (uint32_t w = 0; w < kGroupSize / 64; ++w)
        classes.hidden[w] = classes.visible[w] = 0;
    for (uint32_t i = 0; i < lanes.count; i += uint32_t(hn::Lanes(d))) {
        const V x = hn::Load(d, lanes.x + i), y = hn::Load(d, lanes.y + i), z = hn::Load(d, lanes.z + i);
        const V sigma = expAny(d, hn::Load(d, lanes.log_sigma + i));
        auto hidden = never;
        V magnitude;
        for (const BoundPlane& plane : eye.bounds.planes) {
            const V value = planeValue(d, plane, x, y, z, sigma, magnitude);
            hidden = hn::Or(hidden, hn::Lt(hn::MulAdd(slack, magnitude, value), zero));
        }
        const V depth = hn::MulAdd(
            hn::Set(d, eye.depth[0]), x,
            hn::MulAdd(hn::Set(d, eye.depth[1]), y, hn::MulAdd(hn::Set(d, eye.depth[2]), z, hn::Set(d, eye.depth[3]))));
        auto visible = hn::And(hn::Gt(depth, hn::Set(d, eye.depth_min)), hn::Lt(depth, hn::Set(d, eye.depth_max)));
        visible = hn::And(visible, hn::Lt(sigma, hn::Mul(hn::Set(d, eye.sigma_slope), depth)));
        for (const BoundPlane& plane : eye.inside) {
            const V value = planeValue(d, plane, x, y, z, zero, magnitude);
            visible = hn::And(visible, hn::Gt(hn::NegMulAdd(slack, magnitude, value), zero));
        }
        if (lod.by_distance) {
            const auto shifted = [&](V v, float center) {
                const V delta = hn::Sub(hn::Add(v, hn::Set(d, lod.shift)), hn::Set(d, center));
                return hn::Mul(delta, delta);
            };
            const V squared = hn::Add(hn::Add(shifted(x, eye.bounds.center[0]), shifted(y, eye.bounds.center[1])),
                                      shifted(z, eye.bounds.center[2]));
            const V margin =
                hn::Sub(hn::MulAdd(hn::Set(d, lod.slope), hn::Load(d, lanes.extra_level + i), hn::Set(d, lod.limit)),
                        hn::Mul(hn::Set(d, 0.5f), roughLog(d, squared)));
            hidden = hn::Or(hidden, hn::Lt(margin, hn::Set(d, -kLodSlack)));
            visible = hn::And(visible, hn::Gt(margin, hn::Set(d, kLodSlack)));
        }
        classes.hidden[i / 64] |= uint64_t(maskBits(hidden)) << i % 64;
        classes.visible[i / 64] |= uint64_t(maskBits(hn::AndNot(hidden, visible))) << i % 64;
    }
}

} // namespace HWY_NAMESPACE
} // namespace gsc
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gsc {

HWY_EXPORT(classify);

EyeClassifier eyeClassifier(const ModelParams& params, const EyeParams& eye, const RasterConstants& rules,
                            float lod_bias, float lod_fade)
{
    EyeClassifier classifier{};
    classifier.bounds = eyeBounds(eye, rules, lod_bias, lod_fade);
    const float* w = eye.world_to_view;
    const float focal[2] = {eye.focal_x, eye.focal_y}, tan_mid[2] = {eye.tan_mid_x, eye.tan_mid_y};
    const uint32_t size[2] = {eye.width, eye.height};
    for (int axis = 0; axis < 2; ++axis)
        for (int side = 0; side < 2; ++side) {
            // plane of pixels 0 <= X <= size - 1, times z: the square round such a pixel touches a tile of the image
            BoundPlane& plane = classifier.inside[2 * axis + side];
            const float sign = side == 0 ? focal[axis] : -focal[axis];
            const float slope = 0.5f * (float(size[axis]) - 1) - sign * tan_mid[axis];
            for (int i = 0; i < 3; ++i)
                plane.n[i] = sign * w[4 * axis + i] + slope * w[8 + i];
            plane.offset = sign * w[4 * axis + 3] + slope * w[11];
        }
    for (int i = 0; i < 4; ++i)
        classifier.depth[i] = w[8 + i];
    classifier.depth_min = rules.near_z * 1.0001f + 1e-6f;
    classifier.depth_max = 1e9f;
    // Limits sigma to 100 pixels. If variances are at most M square pixels, the exact determinant is at least 0.3 (a +
    // c) and its rounding about 20 epsilon a c, so that it cannot vanish below M = 2.5e5.
    classifier.sigma_slope = 100.0f * 3.0f / classifier.bounds.planes[1].sigma_factor;
    const float* q = params.constant_rotation;
    const float norm = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
    classifier.usable = norm > 1e-6f && norm < 1e6f && (params.flags & kModelHasRotation) == 0;
    return classifier;
}

LodClassifier lodClassifier(const ModelParams& params, int32_t level, float lod_bias, float lod_fade)
{
    LodClassifier lod{};
    lod.shift = lodShift<float>(params, level);
    const LevelRule rule = LevelRule(params.level_rule);
    lod.by_distance = rule != LevelRule::None && level > 0;
    if (!lod.by_distance)
        return lod;
    // lowest: smallest predicted level at which this level is shown
    const float ramp = rule == LevelRule::Progressive ? 0.0f : lod_fade;
    const float lowest = float(level) - switchOffset(rule) - 0.5f * ramp;
    lod.slope = std::log(float(params.fork));
    lod.limit = level > params.level_clamp
                    ? -INFINITY
                    : std::log(params.standard_dist / params.lod_scale) - (lowest - lod_bias) * lod.slope;
    return lod;
}

void classifyGroup(const EyeClassifier& eye, const LodClassifier& lod, const GroupLanes& lanes, Classes& classes)
{
    HWY_DYNAMIC_DISPATCH(classify)(eye, lod, lanes, classes);
}

} // namespace gsc
#endif
