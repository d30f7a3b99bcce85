// SPDX-License-Identifier: Apache-2.0
// What was asked of levels and foveation, as reports say it.
#pragma once

#include "player/options/play_options.h"
#include "runtime/records/frame_numbers.h"

#include <string>

namespace gsc {

OrderedJson foveaJson(const PlayOptions& options); // "fovea_pixels": null without foveation

// "lod_bias", "lod_fade", "lod_hysteresis", "fovea_pixels", and "target_ms" and "lod_bias_used", null without a target.
OrderedJson lodJson(const PlayOptions& options, TimedFrames frames);
std::string targetText(const PlayOptions& options, TimedFrames frames); // a line; empty without a target

} // namespace gsc
