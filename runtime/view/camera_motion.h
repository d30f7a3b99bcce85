// SPDX-License-Identifier: Apache-2.0
// Places of the cameras of a frame's eyes, and their movement from frame to frame.
#pragma once

#include "kernels/reuse/policy.h"

namespace gsc {

class CameraMotion {
public:
    // Once per frame. A step that is no number starts anew, and so does an eye that was not there.
    void follow(const EyeParams* eyes, uint32_t eye_count);
    void forget(); // the next frame's cameras are not continuous with the last

    [[nodiscard]] const EyeMotion (&eyes() const)[kMaxEyes] { return m_eyes; }

private:
    EyeMotion m_eyes[kMaxEyes];
    uint32_t m_history[kMaxEyes] = {}; // frames in a row that the centre is known for, with the last one
};

} // namespace gsc
