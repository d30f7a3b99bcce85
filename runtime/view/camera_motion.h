// SPDX-License-Identifier: Apache-2.0
// Where the cameras of a frame's eyes are and how they move, from frame to frame.
#pragma once

#include "kernels/frame/frame_types.h"

namespace gsc {

class CameraMotion {
public:
    // Once per frame. A step that is no number starts anew, and so does an eye that was not there.
    void follow(const EyeParams* eyes, uint32_t eye_count);
    void forget(); // nobody knows how the cameras get to the next frame

    [[nodiscard]] const float* center(uint32_t eye) const { return m_center[eye]; }
    [[nodiscard]] const float* step(uint32_t eye) const { return m_step[eye]; } // since the last frame, world units
    // The motion is much like that of the frame before.
    [[nodiscard]] bool steady(uint32_t eye) const { return m_steady[eye]; }
    // It moves, and not so.
    [[nodiscard]] bool erratic(uint32_t eye) const { return m_erratic[eye]; }
    // How far from where it pointed the last step went aside, as a share of it.
    [[nodiscard]] float bend(uint32_t eye) const { return m_bend[eye]; }
    // Frames in a row that the centre is known for, with this one.
    [[nodiscard]] uint32_t history(uint32_t eye) const { return m_history[eye]; }

private:
    float m_center[kMaxEyes][3] = {}, m_step[kMaxEyes][3] = {};
    float m_bend[kMaxEyes] = {};
    bool m_steady[kMaxEyes] = {}, m_erratic[kMaxEyes] = {};
    uint32_t m_history[kMaxEyes] = {};
};

} // namespace gsc
