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
    uint64_t warm_bytes = 0; // most bytes that were resident in the warm-up; 0 = no warm-up
    AnchorCost anchor_cost;  // cost of the model's anchors
    DeviceCeilings ceilings; // may be unknown
};

// Counts of the measured frames. Precondition: at least one frame.
WorkFacts workFacts(const WorkContext& context, TimedFrames frames);

} // namespace gsc
