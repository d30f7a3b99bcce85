// SPDX-License-Identifier: Apache-2.0
// How many workers draw: Algorithm 2 of the GS-Cache paper, with a look ahead. Pure: knows no thread and no clock.
#pragma once

#include "runtime/service/policy/service_time.h"

#include <cstdint>
#include <optional>
#include <string>

namespace gsc {

// A worker starts where the rate is below min_fps, and one stops where it is above (1 + 1/N) max_fps, N workers
// remaining. 0 = no such limit: without min_fps all draw from the start, and one that has stopped stays so.
struct PaceRules {
    double min_fps = 0, max_fps = 0;
    ServiceTime start_after{std::chrono::milliseconds(20)};  // that the rate is too low
    ServiceTime stop_after{std::chrono::milliseconds(1000)}; // that it is too high
    ServiceTime settle{std::chrono::milliseconds(100)};      // between two steps: until the rate shows the first

    [[nodiscard]] bool elastic() const { return min_fps > 0 || max_fps > 0; }
};

// Frames per second that the workers at work can draw, whether or not as many are asked for.
struct PaceFacts {
    uint32_t working = 0;      // draw, or are to
    uint32_t starting = 0;     // of these: load the model, so the rate is still without them
    uint32_t ready = 0;        // could be started
    double rate = 0;           // measured, 0 = not known
    double predicted_rate = 0; // of the frames to come, 0 = not known
};

enum class PaceStep { Keep, Start, Stop };

struct PaceDecision {
    PaceStep step = PaceStep::Keep;
    std::string cause; // of a start or stop, in words
};

class Pace {
public:
    explicit Pace(const PaceRules& rules) : m_rules(rules) {}

    // At any times, in order. A start or stop that it asks for is taken to happen.
    PaceDecision look(ServiceTime now, const PaceFacts& facts);

private:
    PaceRules m_rules;
    std::optional<ServiceTime> m_low, m_high; // since when without a break
    std::optional<ServiceTime> m_stepped;     // last
};

} // namespace gsc
