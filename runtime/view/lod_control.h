// SPDX-License-Identifier: Apache-2.0
// Holds a frame time by raising the cut: how much detail the next frame gets, from how long the last ones took.
#pragma once

#include <cstdint>

namespace gsc {

struct LodControlOptions {
    double target_ms = 0;   // above 0; frames are kept just below it
    double finest_bias = 0; // levels: where it starts and what it gives back up to
    double coarsest_bias = -16;
};

// A damped integrator: each frame moves the bias by a share of ln(aim / time), quickly down and slowly up, where time
// is the median of the last three frames, so that a single late one moves nothing. Between `kQuiet` of the target and
// the target itself nothing moves, which is why a steady scene comes to rest. It knows nothing of the scene: it
// holds for anything whose time falls by a factor of up to 8 per level, told up to three frames late.
class LodControl {
public:
    static constexpr double kAim = 0.95, kQuiet = 0.9;       // of the target
    static constexpr double kDown = 0.15, kUp = 0.03;        // levels per frame and factor e off the aim
    static constexpr double kMostDown = 0.2, kMostUp = 0.03; // levels per frame

    // Precondition: target_ms > 0, coarsest_bias <= finest_bias.
    explicit LodControl(const LodControlOptions& options) : m_options(options), m_bias(options.finest_bias) {}

    [[nodiscard]] double bias() const { return m_bias; } // for the next frame

    // The time of a frame, in order. What is not a positive number is passed over.
    void add(double frame_ms);

private:
    LodControlOptions m_options;
    double m_bias;
    double m_times[3] = {};
    uint32_t m_count = 0; // of frames, at most 3
};

} // namespace gsc
