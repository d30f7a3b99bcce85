// SPDX-License-Identifier: Apache-2.0
#include "clock.h"

#include <cerrno>
#include <cmath>

namespace gsc::fake_xr {

namespace {

constexpr int64_t kSecond = 1'000'000'000;

} // namespace

void RefreshGrid::start(double hz, XrTime first, int64_t index)
{
    m_hz = hz;
    m_first = first;
    m_index = index;
}

void RefreshGrid::setRate(double hz, int64_t from_index)
{
    start(hz, timeOf(from_index), from_index);
}

// From the start and not by adding periods: refresh 90 of 90 Hz is exactly one second later.
XrTime RefreshGrid::timeOf(int64_t index) const
{
    return m_first + std::llround(double(index - m_index) * double(kSecond) / m_hz);
}

XrDuration RefreshGrid::period() const
{
    return std::llround(double(kSecond) / m_hz);
}

int64_t RefreshGrid::indexAfter(XrTime time) const
{
    int64_t index = m_index + int64_t(std::floor(double(time - m_first) * m_hz / double(kSecond)));
    while (timeOf(index) <= time)
        ++index;
    return index;
}

XrTime monotonicNow()
{
    timespec now{};
    clock_gettime(CLOCK_MONOTONIC, &now);
    return now.tv_sec * kSecond + now.tv_nsec;
}

void sleepUntil(XrTime time)
{
    const timespec at{time / kSecond, time % kSecond};
    while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &at, nullptr) == EINTR) {
    }
}

} // namespace gsc::fake_xr
