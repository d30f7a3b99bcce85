// SPDX-License-Identifier: Apache-2.0
#include "player/xr/late_eyes.h"

#include <gsc/error.h>

#include <algorithm>

namespace gsc {

namespace {

constexpr double kDrawsShare = 0.2; // weight of the newest picture in the running mean m_draws_ms

// longest time from refresh to refresh that is believed, ns; a runtime that states more does not know it
constexpr int64_t kMostPeriod = 1000000000;

} // namespace

int64_t seenAt(std::chrono::steady_clock::time_point now, std::chrono::nanoseconds draws,
               std::chrono::steady_clock::time_point woken, int64_t display_time, int64_t period)
{
    if (period <= 0 || period > kMostPeriod)
        return display_time;
    const int64_t there = std::chrono::nanoseconds(now - woken).count() + draws.count();
    return display_time + (there <= 0 ? 0 : (there + period - 1) / period * period);
}

void LateEyes::woke(std::chrono::steady_clock::time_point at, const HeadsetFrame& frame)
{
    const std::lock_guard lock(m_mutex);
    m_woken = at;
    m_frame = frame;
}

void LateEyes::drew(double ms)
{
    const std::lock_guard lock(m_mutex);
    m_draws_ms = m_draws_ms == 0 ? ms : m_draws_ms + kDrawsShare * (ms - m_draws_ms);
}

void LateEyes::stop()
{
    const std::lock_guard lock(m_calls);
    m_headset = nullptr;
}

int64_t LateEyes::nextTime()
{
    const std::lock_guard lock(m_mutex);
    if (m_waits)
        return m_frame.display_time;
    return seenAt(std::chrono::steady_clock::now(), std::chrono::nanoseconds(int64_t(1e6 * m_draws_ms)), m_woken,
                  m_frame.display_time, m_frame.period);
}

bool LateEyes::find(LateLook& look, const std::vector<SpaceEye>& asked)
{
    const std::lock_guard lock(m_calls);
    if (look.looked || m_headset == nullptr)
        return look.found;
    look.looked = true;
    look.time = nextTime();
    try {
        look.found = m_headset->locate(look.time, look.eyes) && std::ranges::equal(look.eyes, asked, sameLens);
    } catch (const Error&) { // the headset has gone; the frame loop will find out by itself
        look.found = false;
    }
    return look.found;
}

} // namespace gsc
