// SPDX-License-Identifier: Apache-2.0
// Levels, detail and foveation as they were asked for, in the words of reports.
#pragma once

#include "player/options/frame_choice.h"
#include "runtime/records/frame_numbers.h"

#include <string>

namespace gsc {

OrderedJson foveaJson(const FrameChoice& choice); // "fovea_pixels": null without foveation

// "lod_bias", "lod_fade", "lod_hysteresis", "detail", "fovea_pixels", and "target_ms", "lod_bias_used" and "detail_used",
// null without a target.
OrderedJson lodJson(const FrameChoice& choice, TimedFrames frames);
std::string targetText(const FrameChoice& choice, TimedFrames frames); // a line; empty without a target
std::string detailText(const FrameChoice& choice, TimedFrames frames); // a line; empty without detail

} // namespace gsc
