// SPDX-License-Identifier: Apache-2.0
// Number of workers that draw: Algorithm 2 of the GS-Cache paper, with a prediction. Pure: knows no thread and no clock.
#pragma once

#include "runtime/service/policy/service_time.h"

#include <cstdint>
#include <optional>
#include <string>

namespace gsc {

// A worker starts if the rate is below min_fps; one stops if the rate is above (1 + 1/N) max_fps, N workers remaining.
// 0 = no such limit: without min_fps all draw from the start, and a stopped worker stays stopped.
struct PaceRules {
    double min_fps = 0, max_fps = 0;
    ServiceTime start_after{std::chrono::milliseconds(20)};  // time with too low a rate before a worker starts
    ServiceTime stop_after{std::chrono::milliseconds(1000)}; // time with too high a rate before a worker stops
    ServiceTime settle{std::chrono::milliseconds(100)};      // pause between two steps: the rate must show the first

    [[nodiscard]] bool elastic() const { return min_fps > 0 || max_fps > 0; }
};

// State that Pace decides from. Rates: frames per second that the workers can draw, even if fewer are asked for.
struct PaceFacts {
    uint32_t working = 0;      // workers that draw, or are to
    uint32_t starting = 0;     // part of `working`: they load the model, so the rate is still without them
    uint32_t ready = 0;        // workers that could be started
    double rate = 0;           // measured, 0 = not known
    double predicted_rate = 0; // rate of the frames to come, 0 = not known
};

enum class PaceStep { Keep, Start, Stop };

struct PaceDecision {
    PaceStep step = PaceStep::Keep;
    std::string cause; // cause of a start or stop, in words
};

class Pace {
public:
    explicit Pace(const PaceRules& rules) : m_rules(rules) {}

    // Called with rising times. Assumes that each start or stop it asks for is carried out.
    PaceDecision look(ServiceTime now, const PaceFacts& facts);

private:
    PaceRules m_rules;
    std::optional<ServiceTime> m_low, m_high; // start of the time that the rate has been too low; too high
    std::optional<ServiceTime> m_stepped;     // time of the last step
};

} // namespace gsc
