// SPDX-License-Identifier: Apache-2.0
// Decides how many workers draw: Algorithm 2 of the GS-Cache paper, extended by a prediction. Knows no thread and no
// clock.
#pragma once

#include "runtime/service/policy/service_time.h"

#include <cstdint>
#include <optional>
#include <string>

namespace gsc {

// Rules by which workers are started and stopped. A worker starts if the rate is below min_fps. One stops if the rate
// is above (1 + 1/N) max_fps, where N workers remain. 0 = no such limit: without min_fps all workers draw from the
// start, and a stopped one stays stopped.
struct PaceRules {
    double min_fps = 0, max_fps = 0;
    // time for which the rate must be too low before a worker starts
    ServiceTime start_after{std::chrono::milliseconds(20)};
    // time for which the rate must be too high before a worker stops
    ServiceTime stop_after{std::chrono::milliseconds(1000)};
    // shortest time between two starts or stops, so that the rate shows the effect of the first
    ServiceTime settle{std::chrono::milliseconds(100)};

    [[nodiscard]] bool elastic() const { return min_fps > 0 || max_fps > 0; }
};

// Facts that Pace decides by. Rates are the frames per second that the workers can draw, even if fewer are asked for.
struct PaceFacts {
    uint32_t working = 0;      // number of workers that draw, or will once they have the model
    uint32_t starting = 0;     // number of those that still load the model, which the rate does not include
    uint32_t ready = 0;        // number of workers that could be started
    double rate = 0;           // measured rate, 0 = not known
    double predicted_rate = 0; // predicted rate of the next frames, 0 = not known
};

enum class PaceStep { Keep, Start, Stop };

struct PaceDecision {
    PaceStep step = PaceStep::Keep;
    std::string cause; // cause of a start or stop, in words
};

class Pace {
public:
    explicit Pace(const PaceRules& rules) : m_rules(rules) {}

    // Decides on the next start or stop. Call it with rising times; it assumes that its decisions are carried out.
    PaceDecision look(ServiceTime now, const PaceFacts& facts);

private:
    PaceRules m_rules;
    std::optional<ServiceTime> m_low, m_high; // since when the rate has been too low; since when it has been too high
    std::optional<ServiceTime> m_stepped;     // time of the last start or stop
};

} // namespace gsc
