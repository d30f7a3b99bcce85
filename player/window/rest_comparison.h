// SPDX-License-Identifier: Apache-2.0
// Compares a pose at rest with its exact picture. Both are drawn once more as floats: with the window's settings, and
// in tier exact.
#pragma once

#include "player/window/comparison.h"
#include "player/devices/frame_source.h"

namespace gsc {

class RestComparison {
public:
    explicit RestComparison(FrameSource& source) : m_source(source) {}

    void moved(double seconds); // call when the pose or its settings change; the comparison begins anew
    void showOtherwise() { m_composed.clear(); }

    // Submits the next missing picture, once the pose has rested and no other picture is under way. Throws Error.
    void advance(double seconds, AskedPose pose, const FrameOptions& options);
    // Takes a picture that advance() submitted; ignores others. Returns true if the comparison is ready.
    bool take(DrawnPose& drawn);

    [[nodiscard]] bool underWay() const { return m_state == State::Picture || m_state == State::Exact; }
    [[nodiscard]] bool ready() const { return m_comparison != nullptr; }
    // returns true if nothing is left to compute, FLIP included
    [[nodiscard]] bool complete() { return !ready() || m_comparison->complete(); }
    // numbers() and pictures() have the precondition ready(). Pictures stay valid until moved(), showOtherwise(), or a
    // call with another mode or share.
    [[nodiscard]] ComparedNumbers numbers() { return m_comparison->numbers(); }
    [[nodiscard]] const std::vector<Picture8>& pictures(CompareMode mode, double share);

    void forgetRetired(); // frees comparisons that were given up, once their threads have computed FLIP

private:
    enum class State { Moving, Picture, Exact, Compared };

    FrameSource& m_source;
    State m_state = State::Moving;
    double m_rests_since = 0;
    uint64_t m_pose = 0; // number of the pose submitted last
    std::vector<Image> m_picture;
    std::unique_ptr<Comparison> m_comparison;
    // comparisons that were given up while their threads compute FLIP
    std::vector<std::unique_ptr<Comparison>> m_retired;
    std::vector<Picture8> m_composed;
};

} // namespace gsc
