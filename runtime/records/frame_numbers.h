// SPDX-License-Identifier: Apache-2.0
// Times and counts of drawn frames, with their names in reports, and their statistics.
#pragma once

#include <gsc/frame_types.h>
#include "runtime/records/report_parts.h"

#include <array>
#include <functional>
#include <iterator>
#include <span>
#include <vector>

namespace gsc {

inline constexpr struct {
    const char* name;
    double StageTimes::*field;
} kStages[] = {
    {"select", &StageTimes::select}, {"decode", &StageTimes::decode}, {"project", &StageTimes::project},
    {"bin", &StageTimes::bin},       {"sort", &StageTimes::sort},     {"blend", &StageTimes::blend},
};
constexpr size_t kDecodeStage = 1;

struct EyeCount {
    const char* name;
    uint64_t EyeCounts::*field;
};
inline constexpr EyeCount kEyeCounts[] = {
    {"groups_tested", &EyeCounts::groups_tested},         {"anchors_tested", &EyeCounts::anchors_tested},
    {"anchors_visible", &EyeCounts::anchors_visible},     {"anchors_decoded", &EyeCounts::anchors_decoded},
    {"anchors_reused", &EyeCounts::anchors_reused},       {"anchors_overdue", &EyeCounts::anchors_overdue},
    {"gaussians_alive", &EyeCounts::gaussians_alive},     {"gaussians_visible", &EyeCounts::gaussians_visible},
    {"gaussians_dropped", &EyeCounts::gaussians_dropped}, {"pairs", &EyeCounts::pairs},
    {"blend_evaluations", &EyeCounts::blend_evaluations},
};

// Counts of groups of anchors, by how a frame with detail drew them.
inline constexpr struct {
    const char* name;
    uint64_t CoarseCounts::*field;
} kCoarseCounts[] = {
    {"groups_near", &CoarseCounts::near},
    {"groups_kept", &CoarseCounts::kept},
    {"groups_stale", &CoarseCounts::stale},
    {"groups_made", &CoarseCounts::made},
};

constexpr size_t kTestedCounts = 2; // the first two of kEyeCounts count tests, the others drawing

struct TimedFrame {
    double wall_ms = 0; // milliseconds that the caller waited for the frame
    FrameResult result;
    double pixels = 0;               // pixels of one eye
    double lod_bias = 0, detail = 0; // values of FrameOptions in this frame: levels, pixels
};
using TimedFrames = std::span<const TimedFrame>;

Spread spreadOf(TimedFrames frames, const std::function<double(const TimedFrame&)>& value);
uint64_t sumOf(TimedFrames frames, uint64_t FrameResult::*field);
uint64_t mostOf(TimedFrames frames, uint64_t FrameResult::*field);
uint64_t ofEyes(const TimedFrame& frame, uint64_t EyeCounts::*field); // sum over the eyes
Spread groupsPerFrame(TimedFrames frames, uint64_t CoarseCounts::*field);
Spread countPerEye(TimedFrames frames, int eyes, uint64_t EyeCounts::*field);

// Milliseconds of frames: as the caller waited, on the device, and in each stage.
struct FrameTimes {
    Spread wall, device;
    std::array<Spread, std::size(kStages)> stages; // in the order of kStages
};
FrameTimes timesOf(TimedFrames frames);

// The frames after the first `warmup`; if there are none, the last frame alone.
TimedFrames timedFrames(TimedFrames frames, uint32_t warmup);

// Counts of reuse in a run, over all frames: a cold start is part of its cost.
struct ReuseCounts {
    Spread decoded, reused; // anchors per frame, all eyes
    double hit_rate = 0;    // part of the visible anchors that was reused, 0..1
    uint64_t overdue = 0, evictions = 0, cache_bytes = 0;
};
ReuseCounts reuseCounts(TimedFrames frames);

} // namespace gsc
