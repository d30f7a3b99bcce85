// SPDX-License-Identifier: Apache-2.0
// Depths in the form of a headset's runtime: 1 is at kLeastDepth, 0 at kMostDepth and beyond. So reversed, fp32 has
// steps as fine for far depths as for near ones.
#pragma once

namespace gsc {

constexpr float kLeastDepth = 0.02f, kMostDepth = 10'000.0f; // metres

// `z`: view z, world units; infinity is well. `metre`: world units.
inline float layerDepth(float z, float metre)
{
    constexpr float kScale = kLeastDepth / (kMostDepth - kLeastDepth);
    const float depth = kScale * (kMostDepth * metre / z - 1);
    return depth > 0 ? (depth < 1 ? depth : 1) : 0; // NaN is far
}

} // namespace gsc
