// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>

namespace gsc {

class Stopwatch {
public:
    // Milliseconds since construction or the last lap.
    double lap()
    {
        const Clock::time_point now = Clock::now();
        const double ms = std::chrono::duration<double, std::milli>(now - m_start).count();
        m_start = now;
        return ms;
    }

private:
    using Clock = std::chrono::steady_clock;
    Clock::time_point m_start = Clock::now();
};

} // namespace gsc
