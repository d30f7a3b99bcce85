// SPDX-License-Identifier: Apache-2.0
// Depths as a headset's runtime takes them: 1 is at kLeastDepth, 0 at kMostDepth and beyond. So turned round, the steps of
// fp32 are as fine for what is far as for what is near.
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
