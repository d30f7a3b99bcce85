// SPDX-License-Identifier: Apache-2.0
// Hysteresis of levels. They are chosen from a place that follows the camera at a distance, so that a camera moving to
// and fro at a boundary switches nothing. One place for each eye is all the state. Selection remains a function of its
// arguments, and all bounds and backends work as without hysteresis.
#pragma once

#include <gsc/frame_types.h>

namespace gsc {

// Returns how far the place may lag behind the camera, in world units. No anchor is switched more than
// `lod_hysteresis` levels away from where the trainers switch it, because no switch is nearer to the camera than that
// of the finest level. 0 if nothing is switched. Precondition: 0 <= lod_hysteresis <= 1.
float lodLeash(const ModelView& model, const FrameOptions& options);

class LodLag {
public:
    // The next frame starts with the places at the cameras.
    void clear() { m_known = 0; }

    // Sets `chosen` to `eyes`, with the centres from which levels are chosen. Each eye of a pair is treated as if it
    // were alone. Call it once for each frame, in order. Without hysteresis the centres do not lag, and earlier lag is
    // forgotten.
    void follow(const ModelView& model, const FrameOptions& options, const EyeParams* eyes, uint32_t eye_count,
                EyeParams* chosen);

private:
    float m_center[kMaxEyes][3] = {};
    uint32_t m_known = 0; // number of eyes whose entry of m_center is from the last frame
};

} // namespace gsc
