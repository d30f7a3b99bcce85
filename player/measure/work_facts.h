// SPDX-License-Identifier: Apache-2.0
// Counts of frames and the least work that they must do, as the part "work" of a row.
#pragma once

#include "player/measure/roofline.h"
#include "player/options/frame_choice.h"
#include "runtime/records/run_parts.h"

#include <gsc/device.h>

#include <cstdint>

namespace gsc {

struct WorkContext {
    FrameChoice frame; // as the frames were drawn
    uint32_t eyes = 1;
    uint64_t warm_bytes = 0; // most that was resident in the warm-up; 0 = there was none
    AnchorCost anchor_cost;  // of the model
    DeviceCeilings ceilings; // may be unknown
};

// Precondition: at least one frame.
WorkFacts workFacts(const WorkContext& context, TimedFrames frames);

} // namespace gsc
