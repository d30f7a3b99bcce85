// SPDX-License-Identifier: Apache-2.0
// Prediction of a frame's time from the counts of frames before it: weights of the counts are learned from the times,
// and the trend of the counts is taken to continue. Pure.
#pragma once

#include <gsc/frame_types.h>
#include "runtime/service/policy/service_time.h"

#include <array>
#include <deque>

namespace gsc {

// Counts that determine a frame's cost, of all eyes together.
struct FrameLoad {
    double anchors = 0, pairs = 0, evaluations = 0; // visible; (tile or bin, splat); (pixel, splat)
};

FrameLoad loadOf(const FrameResult& result);

class FrameCost {
public:
    // A frame began at `at` and took `ms`.
    void learn(ServiceTime at, const FrameLoad& load, double ms);

    // Milliseconds of a frame that begins at `at`; 0 before the first was learned. Looks at most kHorizon beyond the last
    // frame.
    [[nodiscard]] double predict(ServiceTime at) const;
    // Milliseconds of a frame of this load.
    [[nodiscard]] double costOf(const FrameLoad& load) const;
    [[nodiscard]] FrameLoad loadAt(ServiceTime at) const;

    static constexpr ServiceTime kHorizon = std::chrono::milliseconds(200);

private:
    using Terms = std::array<double, 4>; // 1 and the counts in units of m_unit

    void growUnits(const FrameLoad& load);
    [[nodiscard]] Terms termsOf(const FrameLoad& load) const;
    [[nodiscard]] Terms weights() const;

    struct Seen {
        double at = 0; // seconds
        FrameLoad load;
    };
    static constexpr size_t kSeen = 12;

    FrameLoad m_unit;
    std::deque<Seen> m_seen;
    double m_products[4][4] = {}; // sums of products of terms, older frames less
    Terms m_with_ms{};            // weighted sums of terms times milliseconds
    double m_mean_ms = 0;
};

} // namespace gsc
