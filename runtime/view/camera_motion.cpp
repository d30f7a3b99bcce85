// SPDX-License-Identifier: Apache-2.0
#include "runtime/view/camera_motion.h"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace gsc {

void CameraMotion::follow(const EyeParams* eyes, uint32_t eye_count)
{
    for (uint32_t e = 0; e < kMaxEyes; ++e) {
        if (e >= eye_count) {
            m_history[e] = 0;
            m_steady[e] = m_erratic[e] = false;
            continue;
        }
        float change = 0, length = 0, square = 0, along = 0, turned = 0;
        for (int i = 0; i < 3; ++i) {
            const float step = m_history[e] > 0 ? eyes[e].center[i] - m_center[e][i] : 0.0f;
            if (!(std::abs(step) < 1e30f))
                m_history[e] = 0;
            change = std::max(change, std::abs(step - m_step[e][i]));
            length = std::max(length, std::abs(step));
            square += step * step;
            along += step * (step - m_step[e][i]);
            turned += (step - m_step[e][i]) * (step - m_step[e][i]);
            m_step[e][i] = m_history[e] > 0 ? step : 0.0f;
            m_center[e][i] = eyes[e].center[i];
        }
        m_steady[e] = m_history[e] > 0 && length > 0 && (m_history[e] == 1 || change <= 0.5f * length);
        m_erratic[e] = m_history[e] > 0 && length > 0 && !m_steady[e];
        const float aside = m_history[e] > 1 && square > 0 ? turned / square - along / square * (along / square) : 0.0f;
        m_bend[e] = std::sqrt(std::max(aside, 0.0f));
        ++m_history[e];
    }
}

void CameraMotion::forget()
{
    std::fill(std::begin(m_history), std::end(m_history), 0u);
}

} // namespace gsc
