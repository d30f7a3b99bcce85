// SPDX-License-Identifier: Apache-2.0
// Compares a pose at rest with the exact picture of it: draws it twice more with all digits, with the window's settings
// and exactly.
#pragma once

#include "player/window/comparison.h"
#include "player/devices/frame_source.h"

namespace gsc {

class RestComparison {
public:
    explicit RestComparison(FrameSource& source) : m_source(source) {}

    void moved(double seconds); // the pose or its settings changed at that time
    void showOtherwise() { m_composed.clear(); }

    // Submits the missing pictures, once the pose has rested and nothing else is under way. Throws Error.
    void advance(double seconds, AskedPose pose, const FrameOptions& options);
    // A picture that advance() asked for; others are ignored. True: the comparison is ready.
    bool take(DrawnPose& drawn);

    [[nodiscard]] bool underWay() const { return m_state == State::Picture || m_state == State::Exact; }
    [[nodiscard]] bool ready() const { return m_comparison != nullptr; }
    [[nodiscard]] bool complete() { return !ready() || m_comparison->complete(); } // FLIP is known, too
    // Precondition of both: ready(). Pictures stay until moved(), showOtherwise() or another mode or share.
    [[nodiscard]] ComparedNumbers numbers() { return m_comparison->numbers(); }
    [[nodiscard]] const std::vector<Picture8>& pictures(CompareMode mode, double share);

    void forgetRetired(); // comparisons that were left before their FLIP was known, once it is

private:
    enum class State { Moving, Picture, Exact, Compared };

    FrameSource& m_source;
    State m_state = State::Moving;
    double m_rests_since = 0;
    uint64_t m_pose = 0; // pose submitted last
    std::vector<Image> m_picture;
    std::unique_ptr<Comparison> m_comparison;
    std::vector<std::unique_ptr<Comparison>> m_retired; // comparisons whose FLIP is no longer wanted
    std::vector<Picture8> m_composed;
};

} // namespace gsc
