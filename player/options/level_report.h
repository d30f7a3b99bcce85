// SPDX-License-Identifier: Apache-2.0
// Options of levels, detail and foveation in reports.
#pragma once

#include "player/options/frame_choice.h"
#include "runtime/records/frame_numbers.h"
#include "runtime/records/run_parts.h"

#include <optional>
#include <string>

namespace gsc {

// "lod_bias", "lod_fade", "lod_hysteresis", "detail", "fovea_pixels", and "target_ms", "lod_bias_used" and "detail_used",
// null without a target.
OrderedJson lodJson(const FrameChoice& choice, TimedFrames frames);
// LOD bias and detail that the frame time target chose; none without a target. Precondition: at least one frame.
std::optional<TargetFacts> targetFacts(const FrameChoice& choice, TimedFrames frames);
std::string targetText(double target_ms, const std::optional<TargetFacts>& used); // a line; empty without a target
std::string detailText(const FrameChoice& choice, TimedFrames frames);            // a line; empty without detail

} // namespace gsc
