// SPDX-License-Identifier: Apache-2.0
// Change of an anchor's picture while its decoded Gaussians are kept (design section 5), on a CPU. policy.h decides by
// it.
#pragma once

#include <gsc/frame_types.h>
#include "kernels/math/real.h"

#include <cmath>

namespace gsc {

// Range on the line between its keys in which a strip can be drawn, as shares of the way: Gaussians that show only
// beyond are not kept.
constexpr float kLeastMix = -0.5f, kMostMix = 1.5f;
// Between two keys the change predicted from one to the other is all there but for this share, in the middle: measured on
// four trained models and the paths of gsc sample paths.
constexpr float kCurve = 0.07f;
constexpr float kBroad = 0.02f; // a Gaussian that covers a larger share of the picture is broad
constexpr float kThinnest = 16;

// Fixed per strip, spread over [0.3, 1).
inline float stagger(uint32_t strip)
{
    return 0.3f + 0.7f * float(strip * 2654435769u >> 8) * 0x1p-24f;
}

// Share of the bound that is left to a strip one of whose Gaussians takes `cover` of the picture, needles counted by
// their thinness(). The bound is one of pixels: an error of that size in a few of them is nothing, in all of them at once
// it is a flash. So none adds more to the mean square error of the picture than one that takes kBroad of it at the bound.
inline float broadShare(float cover)
{
    return cover > kBroad ? std::sqrt(kBroad / cover) : 1.0f;
}

// Correction for thin splats: a sensitivity counts axes thinner than `least` of the longest as that long, so a turn of
// a thinner splat changes more pixels than predicted, by this factor of the mean square, 1 to kThinnest. `conic`: the
// inverse of its covariance, xx, xy, yy.
inline float thinness(const float* conic, float least)
{
    const float trace = conic[0] + conic[2], determinant = conic[0] * conic[2] - conic[1] * conic[1];
    const float more = least * least * trace * trace / determinant; // about the square of long over thin
    return !(determinant > 0) || more > kThinnest ? kThinnest : more > 1 ? more : 1.0f;
}

// Predicted change of anchor p's picture, 1 = full scale, when the camera moves from c0 to c1. direction, distance: its
// sensitivities, per change of the unit direction and per relative change of the distance. The scalar twin of
// stripError(). Not finite where a camera lies on the anchor.
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

// Values that bound predictedChange() of any of a strip's anchors for cameras about one point, the reference, without
// looking at the anchors again. d: distance of an anchor from the reference.
struct StripReach {
    float rate = 0;    // the largest (direction + distance) / d of its sensitivities, per world unit
    float nearest = 0; // the least d, world units; 0 where nothing is known
    float weight = 0;  // the largest direction + distance
};

// Never below predictedChange() of any anchor, as computed in floats, for a camera that went from c0 to c1; +infinity
// where the bound says nothing. Chord and stretch are both at most |c1 - c0| / min(la, lb), and neither camera is
// nearer to an anchor than its distance from the reference less the cameras' own.
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
    // note: with room for the roundings of both, which in the chord are some 1e-7 whatever its length
    return 1.001f * reach.rate * std::sqrt(step) / left + 1e-6f * reach.weight;
}

// Keys of a strip: the camera centres that it was, or will be, decoded from. It is drawn on the line between both, and
// on along it; by any eye.
struct StripKeys {
    float center[2][3] = {}; // world units; the way of the camera goes from the first to the second, which is the first
                             // again where there is one
    float span = 0;          // predicted change from the first to the second of the anchors `lanes`, 1 = full scale
    StripReach reach;        // about the second, of the anchors `lanes` at least
    uint16_t lanes = 0;      // bit i: anchor i of the strip, seen by an eye since it was decoded
    uint8_t count = 0;       // 1 or 2
    uint8_t fresh = 0;       // other than 0: nothing of the strip and eye was kept before
};

// Point on the way between its keys at which an entry is drawn for a camera.
struct KeyPlace {
    float t;        // 0 draws the first key, 1 the second; from kLeastMix to kMostMix, on along the line
    float curve;    // change that the way between the keys adds to that from `point` to the camera, 1 = full scale
    float point[3]; // point of the keys' line nearest to the camera
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
