// SPDX-License-Identifier: Apache-2.0
// Depths in the form that OpenXR takes: 1 at kLeastDepth metres, 0 at kMostDepth and beyond. In this reversed form
// fp32 is as precise for far depths as for near ones.
#pragma once

namespace gsc {

constexpr float kLeastDepth = 0.02f, kMostDepth = 10'000.0f; // range of depths that are told apart, metres

// Converts a depth `z`, in world units along the view's axis; infinity is allowed. `metre` is the number of world
// units in a metre.
inline float layerDepth(float z, float metre)
{
    constexpr float kScale = kLeastDepth / (kMostDepth - kLeastDepth);
    const float depth = kScale * (kMostDepth * metre / z - 1);
    return depth > 0 ? (depth < 1 ? depth : 1) : 0; // a NaN fails the comparison and counts as far
}

} // namespace gsc
