// SPDX-License-Identifier: Apache-2.0
#include "runtime/view/lod_control.h"

#include <algorithm>
#include <cmath>

namespace gsc {

void LodControl::add(double frame_ms)
{
    if (!(frame_ms > 0) || !std::isfinite(frame_ms))
        return;
    m_times[0] = m_times[1];
    m_times[1] = m_times[2];
    m_times[2] = frame_ms;
    m_count = std::min(m_count + 1, 3u);
    if (m_count < 3) // the first frame of a run fills caches and buffers
        return;
    const auto [low, high] = std::minmax(m_times[0], m_times[1]);
    const double median = std::clamp(m_times[2], low, high);
    const double target = m_options.target_ms;
    if (median >= kQuiet * target && median <= target)
        return;
    const double error = std::log(kAim * target / median);
    const double step = error < 0 ? std::max(kDown * error, -kMostDown) : std::min(kUp * error, kMostUp);
    m_bias = std::clamp(m_bias + step, m_options.coarsest_bias, m_options.finest_bias);
}

} // namespace gsc
