// SPDX-License-Identifier: Apache-2.0
// Predicts the time of a frame from the counts of earlier ones. The time per count is learned from their times, and
// the trend of the counts is assumed to continue. No input but its arguments.
#pragma once

#include <gsc/frame_types.h>
#include "runtime/service/policy/service_time.h"

#include <array>
#include <deque>

namespace gsc {

// Counts of a frame, over all eyes, that determine its cost.
struct FrameLoad {
    // visible anchors; pairs of splat and tile or bin; evaluations of a splat at a pixel
    double anchors = 0, pairs = 0, evaluations = 0;
};

FrameLoad loadOf(const FrameResult& result);

class FrameCost {
public:
    // Learns from a frame that began at `at` and took `ms`.
    void learn(ServiceTime at, const FrameLoad& load, double ms);

    // Predicts the milliseconds of a frame that begins at `at`, but at most kHorizon after the last frame; 0 before
    // any frame was learned.
    [[nodiscard]] double predict(ServiceTime at) const;
    // Predicts the milliseconds of a frame with this load.
    [[nodiscard]] double costOf(const FrameLoad& load) const;
    [[nodiscard]] FrameLoad loadAt(ServiceTime at) const;

    static constexpr ServiceTime kHorizon = std::chrono::milliseconds(200);

private:
    using Terms = std::array<double, 4>; // the number 1, and the three counts in units of m_unit

    void growUnits(const FrameLoad& load);
    [[nodiscard]] Terms termsOf(const FrameLoad& load) const;
    [[nodiscard]] Terms weights() const;

    struct Seen {
        double at = 0; // time of a frame's begin, seconds
        FrameLoad load;
    };
    static constexpr size_t kSeen = 12;

    FrameLoad m_unit;
    std::deque<Seen> m_seen;
    double m_products[4][4] = {}; // sums of products of two terms, in which older frames weigh less
    Terms m_with_ms{};            // sums of terms times milliseconds, in which older frames weigh less
    double m_mean_ms = 0;
};

} // namespace gsc
