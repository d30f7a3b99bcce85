// SPDX-License-Identifier: Apache-2.0
// Margins of the tests of selection, for the cut cache. Every test is a plane or a distance against an anchor. With c the
// camera centre at the test, a plane's value at x changes by at most turn * |x - c| + shift afterwards, turn being the
// change of the plane's normal and shift that of its value at c; a distance changes by at most the motion of the centre.
// An outcome found with a margin of `slack` thus holds while turn * reach + shift <= slack, `reach` being the farthest
// |x - c|. (Equal is enough: margins are rounded down, and a camera that stands still needs none.)
#pragma once

#include "kernels/select/classify.h"

#include <cmath>
#include <limits>

namespace gsc {

// Margins are taken with this much of the summands' magnitude to spare: kPlaneSlack for the test of the later frame, the
// rest for the roundings of the margin itself and of kSigmaDrift.
constexpr float kCutPlaneSlack = 3 * kPlaneSlack;
constexpr float kCutLodSlack = 2 * kLodSlack;
// Relative change of a plane's sigma_factor (a rounding, as long as the projection is the same) that is tolerated.
constexpr float kSigmaDrift = 1e-6f;
constexpr float kEndlessSlack = std::numeric_limits<float>::max(); // no motion is too large

// Factors that turn an eye's plane values into world units: 1 / |n|.
struct CutScales {
    float bounds[5];
    float inside[4];
    float depth;
};

// Motion of an eye since one of its earlier poses.
struct CutMotion {
    float turn, shift;

    // Does an outcome found then, with this slack and reach, still hold? Not if anything is no number.
    [[nodiscard]] GSC_HD bool within(float slack, float reach) const { return turn * reach + shift <= slack; }
};

// Farthest that a point of a box is from `center`, rounded up.
GSC_HD float farthest(const float* box_min, const float* box_max, const float* center)
{
    float square = 0;
    for (int i = 0; i < 3; ++i) {
        const float way = maxNumber(std::fabs(box_min[i] - center[i]), std::fabs(box_max[i] - center[i]));
        square += way * way;
    }
    return std::sqrt(square) * 1.00001f;
}

// What distance allows: `margin` is that of ln(distance), slack included. ln(d - t) > ln(d) - u / (1 - u) and
// ln(d + t) < ln(d) + u, with u = t / d.
GSC_HD float levelSlack(float distance, float margin)
{
    return margin > 0 ? 0.999f * distance * (margin / (1 + margin)) : 0.0f;
}

// Largest motion (turn * reach + shift) for which a box that rejectsBox() or rejectsLevel() rejects stays rejected.
GSC_HD float boxSlack(const EyeClassifier& eye, const CutScales& scales, const LodClassifier& lod, const float* box_min,
                      const float* box_max, float sigma, float extra_max)
{
    if (lod.test == LodTest::Never)
        return kEndlessSlack;
    float slack = 0;
    for (int p = 0; p < 5; ++p) {
        const PlaneValue at = largestOfBox(eye.bounds.planes[p], box_min, box_max, sigma);
        const float margin = -(at.value + kCutPlaneSlack * at.magnitude) * scales.bounds[p];
        slack = margin > slack ? margin : slack; // NaN is no margin
    }
    if (lod.test == LodTest::Distance) {
        float square = 0;
        for (int i = 0; i < 3; ++i) {
            const float low = box_min[i] + lod.shift, high = box_max[i] + lod.shift, c = eye.bounds.center[i];
            const float gap = maxNumber(0.0f, maxNumber(low - c, c - high));
            square += gap * gap;
        }
        const float nearest = std::sqrt(square);
        const float margin = std::log(nearest) - (lod.limit + lod.slope * extra_max) - kCutLodSlack;
        const float level = levelSlack(nearest, margin);
        slack = level > slack ? level : slack;
    }
    return slack;
}

// A plane's value at a point less what of its summands is not to be trusted, as `low`, and more, as `high`.
struct CutValue {
    float low, high;
};

GSC_HD CutValue cutValue(const float* n, float offset, const Vec3<float>& p, float reach)
{
    const float x = n[0] * p.x, y = n[1] * p.y, z = n[2] * p.z, value = x + y + z + offset + reach;
    const float spare = kCutPlaneSlack * (std::fabs(x) + std::fabs(y) + std::fabs(z) + std::fabs(offset) + reach);
    return {value - spare, value + spare};
}

// The same as boxSlack() for one anchor, hidden or visible; 0 where the quick look leaves it open (classifyGroup()). What
// laneSlacks() gives, up to rounding, with the logarithm in place of a rough one. sigma: its largest, NaN if any is.
GSC_HD float anchorSlack(const EyeClassifier& eye, const CutScales& scales, const LodClassifier& lod,
                         const Vec3<float>& p, float sigma, float extra_level)
{
    if (lod.test == LodTest::Never)
        return kEndlessSlack;
    float hidden = 0;
    for (int i = 0; i < 5; ++i) {
        const BoundPlane& plane = eye.bounds.planes[i];
        const float margin = -cutValue(plane.n, plane.offset, p, plane.sigma_factor * sigma).high * scales.bounds[i];
        hidden = margin > hidden ? margin : hidden; // NaN is no margin
    }
    const CutValue depth = cutValue(eye.depth, eye.depth[3], p, 0);
    // sigma / z below the slope, as a bound of z
    const float from_least = depth.low - maxNumber(eye.depth_min, sigma / eye.sigma_slope);
    const float from_most = eye.depth_max - depth.high;
    bool proven = sigma == sigma && from_least > 0 && from_most > 0;
    float visible = (from_least < from_most ? from_least : from_most) * scales.depth;
    for (int i = 0; i < 4; ++i) {
        const float margin = cutValue(eye.inside[i].n, eye.inside[i].offset, p, 0).low * scales.inside[i];
        proven = proven && margin > 0;
        visible = margin < visible ? margin : visible;
    }
    if (lod.test == LodTest::Distance) {
        const float x = p.x + lod.shift - eye.bounds.center[0], y = p.y + lod.shift - eye.bounds.center[1],
                    z = p.z + lod.shift - eye.bounds.center[2];
        const float distance = std::sqrt(x * x + y * y + z * z);
        const float margin = lod.limit + lod.slope * extra_level - std::log(distance);
        const float too_far = levelSlack(distance, -margin - kCutLodSlack);
        const float near_enough = levelSlack(distance, margin - kCutLodSlack);
        hidden = too_far > hidden ? too_far : hidden;
        proven = proven && near_enough > 0;
        visible = near_enough < visible ? near_enough : visible;
    }
    return proven ? visible : hidden;
}

} // namespace gsc
