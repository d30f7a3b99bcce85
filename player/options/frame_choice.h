// SPDX-License-Identifier: Apache-2.0
// Settings of how a frame is drawn.
#pragma once

#include <gsc/frame_types.h>
#include "runtime/records/reuse_names.h"

#include <optional>
#include <vector>

namespace gsc {

// Where the foveation's sharp centre lies: nowhere (no foveation), in the middle of the picture, or where the eye
// looks.
enum class FoveationMode { None, Fixed, Gaze };

struct FrameChoice : TierChoice {
    double lod_bias = 0;                     // levels added to the level that the model's rule selects
    double lod_fade = 0, lod_hysteresis = 0; // values for FrameOptions::lod_fade and lod_hysteresis, in levels
    FoveationMode foveation = FoveationMode::None;
    double fovea_pixels = 2; // Foveation::smallest, size in pixels
    StereoMode stereo = StereoMode::Exact;
    ReuseOptions reuse;                           // policy and limits of keeping decoded Gaussians between frames
    std::optional<std::vector<float>> background; // red, green and blue, 0 to 1; none = the model's background
    double near_z = 0;                            // distance of the near plane in world units, 0 = the model's
    double target_ms = 0; // longest time of a frame in milliseconds, kept by a FrameGuard; 0 = none
    bool on_path = true;  // false: the frames are single views, so no coarse copies of a frame before can be used

    // Detail to draw with, in pixels; 0 = none. Tier exact draws without; a window switches to exact and back, so
    // `detail` stays set.
    [[nodiscard]] double detailPixels() const { return tier == Tier::Exact || !on_path ? 0 : detail; }
    [[nodiscard]] double foveaPixels() const { return foveation == FoveationMode::None ? 0 : fovea_pixels; }
};

} // namespace gsc
