// SPDX-License-Identifier: Apache-2.0
// What may be kept between frames, as command lines and reports name it.
#pragma once

#include "player/play_options.h"

#include <CLI/CLI.hpp>

#include <map>
#include <string>

namespace gsc {

constexpr uint32_t kMaxReuseDepth = 1000000; // frames
constexpr double kMaxReuseBound = 255;       // 1/255: the whole range
constexpr double kMaxLodBias = 16;           // levels, either way

const std::map<std::string, ReusePolicy>& reusePolicies();
const std::map<std::string, DepthGuidance>& depthGuidances();
const char* policyName(ReusePolicy policy);
const char* guidanceName(DepthGuidance guidance);

// --reuse and what belongs to it, --lod-bias.
void addReuseOptions(CLI::App& app, PlayOptions& options);

// After parsing: numbers in range, and no option whose policy was not asked for. Throws Error(Usage).
void checkReuseOptions(const CLI::App& app, const PlayOptions& options);

} // namespace gsc
