// SPDX-License-Identifier: Apache-2.0
// Hysteresis of levels: they are chosen from a place that follows the camera on a leash, so that a camera that trembles
// at a boundary switches nothing. One place per eye is all the state there is; selection stays a function of its
// arguments, and every bound and every backend works as it does without.
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

    // `chosen` becomes `eyes` with the centres that levels are to be chosen from. An eye of a pair does what it would
    // do alone. Once per frame, in order; a leash of 0 keeps the centres and leaves nothing behind.
    void follow(const ModelView& model, const FrameOptions& options, const EyeParams* eyes, uint32_t eye_count,
                EyeParams* chosen);

private:
    float m_center[kMaxEyes][3] = {};
    uint32_t m_known = 0; // eyes whose entry of m_center is the last frame's
};

} // namespace gsc
