// SPDX-License-Identifier: Apache-2.0
// Hysteresis of levels: they are chosen from a place that follows the camera at a distance, so that a camera that moves
// to and fro at a boundary switches nothing. One place per eye is all the state; selection stays a function of its
// arguments, and every bound and every backend works as without it.
#pragma once

#include <gsc/frame_types.h>

namespace gsc {

// Length of the leash, world units: no anchor is switched further than `hysteresis` levels from where upstream does,
// because every switch lies at least as far from the camera as that of the finest level. 0 where nothing is switched.
// Precondition: 0 <= hysteresis <= 1.
float lodLeash(const ModelView& model, const FrameOptions& options);

class LodLag {
public:
    // The next frame starts where the camera is.
    void clear() { m_known = 0; }

    // Sets `chosen` to `eyes` with the centres that levels are chosen from. An eye of a pair does as it would alone.
    // Called once per frame, in order. Without hysteresis the centres do not lag, and an earlier lag is forgotten.
    void follow(const ModelView& model, const FrameOptions& options, const EyeParams* eyes, uint32_t eye_count,
                EyeParams* chosen);

private:
    float m_center[kMaxEyes][3] = {};
    uint32_t m_known = 0; // eyes whose entry of m_center is the last frame's
};

} // namespace gsc
