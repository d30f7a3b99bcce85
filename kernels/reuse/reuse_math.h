// SPDX-License-Identifier: Apache-2.0
// Predicts the change of an anchor's picture while its decoded Gaussians are kept (design section 5), on a CPU.
// policy.h decides by it.
#pragma once

#include <gsc/frame_types.h>
#include "kernels/math/real.h"

#include <cmath>

namespace gsc {

// Range, on the line between its two keys, in which a strip can be drawn: 0 is the first key, 1 the second. Gaussians
// that are visible only outside of the range are not kept.
constexpr float kLeastMix = -0.5f, kMostMix = 1.5f;
// Between two keys, only this share of the change predicted from one to the other remains as an error in the middle:
// measured on four trained models and the paths of gsc sample paths.
constexpr float kCurve = 0.07f;
constexpr float kBroad = 0.02f; // a Gaussian that covers a larger share of the picture is called broad
constexpr float kThinnest = 16;

// Number in [0.3, 1) that is fixed for each strip and differs from strip to strip.
inline float stagger(uint32_t strip)
{
    return 0.3f + 0.7f * float(strip * 2654435769u >> 8) * 0x1p-24f;
}

// Share of the bound that remains for a strip one of whose Gaussians covers the share `cover` of the picture (needles
// count by thinness()). The bound is one of pixels: an error of that size is invisible in a few pixels, but a flash in
// all of them at once. So no strip may add more to the mean square error of the picture than one that covers kBroad of
// it and is at the bound.
inline float broadShare(float cover)
{
    return cover > kBroad ? std::sqrt(kBroad / cover) : 1.0f;
}

// Correction for thin splats. A sensitivity counts axes thinner than `least` of the longest as that long, so that the
// turn of a thinner splat changes more pixels than predicted: by this factor in the mean square, 1 to kThinnest.
// `conic`: inverse of the splat's covariance, xx, xy, yy.
inline float thinness(const float* conic, float least)
{
    const float trace = conic[0] + conic[2], determinant = conic[0] * conic[2] - conic[1] * conic[1];
    const float more = least * least * trace * trace / determinant; // about (least x long axis / thin axis)^2
    return !(determinant > 0) || more > kThinnest ? kThinnest : more > 1 ? more : 1.0f;
}

// Predicted change of the picture of an anchor at p, 1 = full scale, when the camera moves from c0 to c1. direction,
// distance: sensitivities of the anchor, per change of the unit direction and per relative change of the distance.
// stripError() computes it for vectors. Not finite if a camera is at the anchor.
inline float predictedChange(const Vec3<float>& p, const float* c0, const float* c1, float direction, float distance)
{
    const float a[3] = {p.x - c0[0], p.y - c0[1], p.z - c0[2]};
    const float b[3] = {p.x - c1[0], p.y - c1[1], p.z - c1[2]};
    const float la = std::sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
    const float lb = std::sqrt(b[0] * b[0] + b[1] * b[1] + b[2] * b[2]);
    float square = 0;
    for (int i = 0; i < 3; ++i) {
        const float d = a[i] / la - b[i] / lb;
        square += d * d;
    }
    return direction * std::sqrt(square) + distance * std::abs(lb - la) / (la < lb ? la : lb);
}

// Values that bound predictedChange() of all anchors of a strip, for cameras near one point, the reference, without
// reading the anchors again. d: distance of an anchor from the reference.
struct StripReach {
    float rate = 0;    // largest (direction + distance) / d of the anchors' sensitivities, per world unit
    float nearest = 0; // smallest d, world units; 0 if nothing is known
    float weight = 0;  // largest direction + distance
};

// Upper bound of predictedChange(), as computed in floats, for all anchors of a strip and a camera that moved from c0
// to c1; +infinity if no bound is known. The changes of direction and of distance are both at most |c1 - c0| / min(la,
// lb), with la and lb the distances of an anchor from c0 and c1; each is at least the anchor's distance from the
// reference, less that of the camera.
inline float changeBound(const StripReach& reach, const float* reference, const float* c0, const float* c1)
{
    float step = 0, far0 = 0, far1 = 0;
    for (int i = 0; i < 3; ++i) {
        step += (c1[i] - c0[i]) * (c1[i] - c0[i]);
        far0 += (c0[i] - reference[i]) * (c0[i] - reference[i]);
        far1 += (c1[i] - reference[i]) * (c1[i] - reference[i]);
    }
    const float left = 1 - std::sqrt(far0 > far1 ? far0 : far1) / reach.nearest;
    if (!(left > 0.01f))
        return INFINITY;
    // note: larger than the rounding of both computations, which for the direction is some 1e-7 whatever the step
    return 1.001f * reach.rate * std::sqrt(step) / left + 1e-6f * reach.weight;
}

// Keys of a strip: the camera centres from which it was, or will be, decoded. Every eye draws it at a point of the line
// through both keys.
struct StripKeys {
    // world units: two places on the camera's way, the earlier one first; both are equal if there is one key
    float center[2][3] = {};
    float span = 0;     // predicted change of the anchors `lanes` from the first key to the second, 1 = full scale
    StripReach reach;   // reach of the anchors `lanes` (or more) with the second key as reference
    uint16_t lanes = 0; // bit i is set if an eye has seen anchor i of the strip since it was decoded
    uint8_t count = 0;  // number of keys, 1 or 2
    uint8_t fresh = 0;  // not 0 if nothing was kept of the strip for this eye before
};

// Point between, or beyond, its keys at which an entry is drawn for a camera.
struct KeyPlace {
    float t; // 0 draws the first key, 1 the second; from kLeastMix to kMostMix
    // change added to that from `point` to the camera, since the way between the keys is no line; 1 = full scale
    float curve;
    float point[3]; // point on the line through the keys that is nearest to the camera, world units
};

inline KeyPlace placeBetween(const StripKeys& keys, const float* camera)
{
    const float(*const center)[3] = keys.center;
    float along = 0, square = 0;
    for (int i = 0; i < 3 && keys.count == 2; ++i) {
        const float way = center[1][i] - center[0][i];
        along += (camera[i] - center[0][i]) * way;
        square += way * way;
    }
    KeyPlace place;
    const float t = square > 0 ? along / square : 0.0f;
    place.t = t < kLeastMix ? kLeastMix : kMostMix < t ? kMostMix : t;
    for (int i = 0; i < 3; ++i)
        place.point[i] = center[0][i] + (keys.count == 2 ? place.t * (center[1][i] - center[0][i]) : 0.0f);
    place.curve = 4 * kCurve * std::abs(place.t * (1 - place.t)) * keys.span;
    return place;
}

} // namespace gsc
