// SPDX-License-Identifier: Apache-2.0
// Holds the time of a headset's frames (--target-ms): while they take too long, first the levels of detail fall, then what the
// periphery shows, then the other levels. Pure. Fewer pixels would make frames slower (README.md).
#pragma once

#include "runtime/view/lod_control.h"

namespace gsc {

struct FrameGuardOptions {
    double target_ms = 0;                      // above 0
    double finest_bias = 0, coarsest_bias = 0; // levels, FrameOptions::lod_bias; equal: the model has one level
    double fovea_pixels = 0;                   // Foveation::smallest, 0 = there is no foveation
};

class FrameGuard {
public:
    static constexpr double kLevelsFirst = 2;    // levels that fall before the periphery does
    static constexpr double kFoveaDoublings = 2; // of `fovea_pixels` at most

    explicit FrameGuard(const FrameGuardOptions& options);

    void add(double frame_ms) { m_control.add(frame_ms); } // in order

    // For the next frame.
    [[nodiscard]] double lodBias() const;
    [[nodiscard]] double foveaPixels() const;

private:
    [[nodiscard]] double spent() const { return -m_control.bias(); } // levels and doublings together

    FrameGuardOptions m_options;
    double m_levels_first, m_doublings;
    LodControl m_control;
};

} // namespace gsc
