// SPDX-License-Identifier: Apache-2.0
// Centres of the eyes of a frame, and how they move from frame to frame.
#pragma once

#include "kernels/reuse/policy.h"

namespace gsc {

class CameraMotion {
public:
    // Takes the eyes of the next frame. Motion starts anew if a step is not finite, and for an eye that the last frame
    // did not have.
    void follow(const EyeParams* eyes, uint32_t eye_count);
    void forget(); // call it if the next frame's cameras do not continue the motion

    [[nodiscard]] const EyeMotion (&eyes() const)[kMaxEyes] { return m_eyes; }

private:
    EyeMotion m_eyes[kMaxEyes];
    uint32_t m_history[kMaxEyes] = {}; // number of frames in a row, up to the last, for which the eye's centre is known
};

} // namespace gsc
