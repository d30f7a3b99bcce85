// SPDX-License-Identifier: Apache-2.0
// Names of tiers, stereo modes and policies of reuse in command lines, sweeps and reports, and limits of numbers there.
#pragma once

#include <gsc/frame_types.h>

#include <string>
#include <utility>
#include <vector>

namespace gsc {

constexpr uint32_t kMaxReuseDepth = 1000000; // frames
constexpr double kMaxReuseBound = 255;       // units of 1/255: the whole range of a colour
constexpr double kMaxLodBias = 16;           // levels, either way
constexpr double kMaxLodWidth = 1;           // levels: largest width of a fade or of a hysteresis
constexpr double kTurboDetail = 2;           // pixels: FrameOptions::detail of the tier turbo

// Choice of --tier: the tier, and the detail that goes with it unless --detail says otherwise.
struct TierChoice {
    Tier tier = Tier::Fast;
    double detail = 0; // pixels, FrameOptions::detail
};

const std::vector<std::pair<std::string, ReusePolicy>>& reusePolicies();
const std::vector<std::pair<std::string, DepthGuidance>>& depthGuidances();
const std::vector<std::pair<std::string, Tier>>& tiers();
const std::vector<std::pair<std::string, TierChoice>>& tierChoices(); // the choices of --tier, with turbo
const std::vector<std::pair<std::string, StereoMode>>& stereoModes();
const char* policyName(ReusePolicy policy);
const char* guidanceName(DepthGuidance guidance);
const char* stereoName(StereoMode stereo);

} // namespace gsc
