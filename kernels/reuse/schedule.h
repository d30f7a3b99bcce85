// SPDX-License-Identifier: Apache-2.0
// Predicts which anchors must be decoded again, from how far the camera has moved since their strip was decoded.
#pragma once

#include "kernels/reuse/depth.h"
#include "kernels/reuse/reuse_math.h"

#include <bit>

namespace gsc {

// Smallest sensitivity that counts: some anchors show nothing to any probe but something to a camera, so none is taken
// as insensitive. It predicts less than half of 1/255 for any change of direction.
constexpr float kLeastSensitivity = 1e-3f;

// Positions of a strip's anchors, and values that tell how long they are kept. Lanes behind the last anchor repeat it.
struct alignas(64) StripAnchors {
    float x[kStripAnchors], y[kStripAnchors], z[kStripAnchors]; // positions of the anchors, world units
    float direction[kStripAnchors]; // from SENS: change per unit of change of the view direction, 1 = full scale
    float distance[kStripAnchors];  // from SENS: change per relative change of the distance, 1 = full scale
};

// Value of a half float that is finite and not negative; halfToFloat() without its special cases.
inline float halfValue(uint16_t half)
{
    return std::bit_cast<float>(uint32_t(half) << 13) * 0x1p112f;
}

// Loads number `strip` of the strips in `group`, which has at least one anchor. `sensitivity`: as in ModelView, two
// half floats for each anchor in file order.
void loadStripAnchors(const ModelView& model, const uint16_t* sensitivity, const GroupRecord& group, uint32_t strip,
                      StripAnchors& anchors);

// Largest predictedChange(), 1 = full scale, of the anchors with a bit in `lanes`, when the camera has moved from `c0`
// to `c1` (world units). +infinity if it is not known.
float stripError(const StripAnchors& anchors, uint32_t lanes, const float* c0, const float* c1);

// Reach of all anchors of a strip, for cameras near `center`, world units.
StripReach stripReach(const StripAnchors& anchors, const float* center);

} // namespace gsc
