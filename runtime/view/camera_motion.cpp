// SPDX-License-Identifier: Apache-2.0
#include "runtime/view/camera_motion.h"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace gsc {

void CameraMotion::follow(const EyeParams* eyes, uint32_t eye_count)
{
    for (uint32_t e = 0; e < kMaxEyes; ++e) {
        EyeMotion& eye = m_eyes[e];
        uint32_t& history = m_history[e];
        if (e >= eye_count) {
            history = 0;
            eye.steady = false;
            continue;
        }
        float change = 0, length = 0, square = 0, along = 0, turned = 0;
        for (int i = 0; i < 3; ++i) {
            const float step = history > 0 ? eyes[e].center[i] - eye.center[i] : 0.0f;
            if (!(std::abs(step) < 1e30f))
                history = 0;
            const float turn = step - eye.step[i];
            change = std::max(change, std::abs(turn));
            length = std::max(length, std::abs(step));
            square += step * step;
            along += step * turn;
            turned += turn * turn;
            eye.step[i] = history > 0 ? step : 0.0f;
            eye.center[i] = eyes[e].center[i];
        }
        eye.steady = history > 0 && length > 0 && (history == 1 || change <= 0.5f * length);
        const float aside = history > 1 && square > 0 ? turned / square - along / square * (along / square) : 0.0f;
        eye.bend = std::sqrt(std::max(aside, 0.0f));
        ++history;
    }
}

void CameraMotion::forget()
{
    std::fill(std::begin(m_history), std::end(m_history), 0u);
}

} // namespace gsc
