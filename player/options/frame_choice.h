// SPDX-License-Identifier: Apache-2.0
// How a frame is drawn.
#pragma once

#include <gsc/frame_types.h>
#include "runtime/records/reuse_names.h"

#include <optional>
#include <vector>

namespace gsc {

// Direction of an eye's gaze, around which everything is drawn.
enum class FoveationMode { None, Fixed, Gaze };

struct FrameChoice : TierChoice {
    double lod_bias = 0;                     // levels added
    double lod_fade = 0, lod_hysteresis = 0; // levels, as FrameOptions has them
    FoveationMode foveation = FoveationMode::None;
    double fovea_pixels = 2; // Foveation::smallest, pixels
    StereoMode stereo = StereoMode::Exact;
    ReuseOptions reuse;                           // how decoded Gaussians are kept between frames
    std::optional<std::vector<float>> background; // 3 values; none = the model's
    double near_z = 0;                            // world units, 0 = the model's
    double target_ms = 0;                         // longest time of a frame, which a FrameGuard holds; 0 = none
    bool on_path = true; // frames follow each other; others have none before them whose coarse copies they may draw

    // A window switches to exact and back, and exact draws everything.
    [[nodiscard]] double detailPixels() const { return tier == Tier::Exact || !on_path ? 0 : detail; }
    [[nodiscard]] double foveaPixels() const { return foveation == FoveationMode::None ? 0 : fovea_pixels; }
};

} // namespace gsc
