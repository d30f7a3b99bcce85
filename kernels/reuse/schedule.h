// SPDX-License-Identifier: Apache-2.0
// Decides which anchors must be decoded again, by how far the view of a strip has moved since it was decoded.
#pragma once

#include "kernels/reuse/depth.h"
#include "kernels/reuse/reuse_math.h"

#include <bit>

namespace gsc {

// Some anchors show nothing to any probe and something to a camera: none is taken for blind. Below half of 1/255 for
// any change of direction.
constexpr float kLeastSensitivity = 1e-3f;

// Positions of a strip's anchors and the values that scheduling needs. Lanes past the last anchor repeat it.
struct alignas(64) StripAnchors {
    float x[kStripAnchors], y[kStripAnchors], z[kStripAnchors]; // world units
    float direction[kStripAnchors]; // SENS: change per unit of view direction, 1 = full scale
    float distance[kStripAnchors];  // SENS: change per relative change of distance
};

// Value of a half that is finite and not negative: halfToFloat() without its special cases.
inline float halfValue(uint16_t half)
{
    return std::bit_cast<float>(uint32_t(half) << 13) * 0x1p112f;
}

// Strip `strip` of `group`, one with an anchor. `sensitivity` as ModelView's: two halves per anchor in file order.
void loadStripAnchors(const ModelView& model, const uint16_t* sensitivity, const GroupRecord& group, uint32_t strip,
                      StripAnchors& anchors);

// Largest predicted change, 1 = full scale, over the anchors with a bit in `lanes`, when the camera went from `c0` to
// `c1` (world units). +infinity where it cannot be told. See predictedChange().
float stripError(const StripAnchors& anchors, uint32_t lanes, const float* c0, const float* c1);

// Reach of all of a strip's anchors, for cameras about `center`, world units.
StripReach stripReach(const StripAnchors& anchors, const float* center);

} // namespace gsc
