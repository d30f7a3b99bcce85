// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>

namespace gsc {

inline double milliseconds(std::chrono::nanoseconds time)
{
    return std::chrono::duration<double, std::milli>(time).count();
}

inline double millisecondsSince(std::chrono::steady_clock::time_point start)
{
    return milliseconds(std::chrono::steady_clock::now() - start);
}

class Stopwatch {
public:
    // Milliseconds since construction or the last call of lap().
    double lap()
    {
        const Clock::time_point now = Clock::now();
        const double ms = milliseconds(now - m_start);
        m_start = now;
        return ms;
    }

private:
    using Clock = std::chrono::steady_clock;
    Clock::time_point m_start = Clock::now();
};

} // namespace gsc
