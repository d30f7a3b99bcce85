// SPDX-License-Identifier: Apache-2.0
// Frames per second that workers can draw, measured and predicted; 0 = not known. The service's mutex must be held in
// every call.
#pragma once

#include "runtime/service/pose_work.h"

#include <algorithm>
#include <utility>

namespace gsc {

class Rates {
public:
    // Learns from a pose; called when all parts of `work` are drawn.
    void learn(const PoseWork& work)
    {
        constexpr double kMeanOf = 8; // number of frames that the running mean covers
        double busy = 0, sum = 0;
        for (const PoseWork::Part& part : work.parts) {
            busy = std::max(busy, part.busy_ms);
            sum += part.busy_ms;
        }
        m_cost.learn(*work.begun, work.load(), work.plan.mode == ServiceMode::Frame ? sum : busy);
        if (std::exchange(m_plan, work.plan) != work.plan)
            m_busy_ms = 0;
        m_busy_ms = m_busy_ms == 0 ? busy : m_busy_ms + (busy - m_busy_ms) / kMeanOf;
    }

    // Returns the measured rate if `workers` workers draw.
    [[nodiscard]] double measured(size_t workers) const
    {
        const size_t turns = m_plan.mode == ServiceMode::Frame ? std::max<size_t>(workers, 1) : 1;
        return m_busy_ms > 0 ? double(turns) * 1000 / m_busy_ms : 0;
    }

    // Returns the predicted rate: `rate`, corrected by the predicted cost of the next frames.
    [[nodiscard]] double foreseen(double rate, ServiceTime now) const
    {
        // a worker that is started now will draw frames from this time on
        constexpr ServiceTime kAhead = std::chrono::milliseconds(100);
        const double now_ms = m_cost.predict(now - kAhead), then_ms = m_cost.predict(now + kAhead);
        return now_ms > 0 && then_ms > 0 ? rate * now_ms / then_ms : 0;
    }

private:
    FrameCost m_cost;
    double m_busy_ms = 0; // running mean of the busy time, per frame, of the worker that takes longest
    SharePlan m_plan;     // plan of the frames that the mean covers; a new plan begins a new mean
};

} // namespace gsc
