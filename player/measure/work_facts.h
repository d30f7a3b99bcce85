// SPDX-License-Identifier: Apache-2.0
// The part "work" of a row: counts of frames, and the least work that they must do.
#pragma once

#include "player/measure/roofline.h"
#include "player/options/frame_choice.h"
#include "runtime/records/run_parts.h"

#include <gsc/device.h>

#include <cstdint>

namespace gsc {

// Facts beside the frames that the part needs.
struct WorkContext {
    FrameChoice frame; // options of the frames
    uint32_t eyes = 1;
    size_t cameras = 1;      // cameras that the measured frames take in turn, again and again
    uint64_t warm_bytes = 0; // most bytes that were resident in the warm-up; 0 = no warm-up
    AnchorCost anchor_cost;  // cost of the model's anchors
    DeviceCeilings ceilings; // may be unknown
};

// Range of the median wall time: between order statistics. Frames of one camera are taken for independent, and cameras as
// given: what differs between them makes the median no less sure. None for fewer than 6 frames.
std::optional<MedianRange> medianRange(TimedFrames frames, size_t cameras);

// The larger distance of the median from an end of its range, in per cent of the median.
double percentOf(const MedianRange& range, double median);

// Counts of the measured frames. Precondition: at least one frame.
WorkFacts workFacts(const WorkContext& context, TimedFrames frames);

} // namespace gsc
