// SPDX-License-Identifier: Apache-2.0
// When the stages of a frame begin and end, by the device's own clock: a kernel of one thread between two stages. An
// event in a captured graph does the same for seven times as much of the device's time and 1.5 us of the host's.
#pragma once

#include "kernels/frame/device_model.h"

struct CUstream_st;

namespace gsc {

// Clock of the stages of a frame, whose counters get the times. Asynchronous, as the kernels that the calls stand
// between.
void startClockCuda(FrameCounters* counters, CUstream_st* stream); // Stage::Select begins
// After the last stage Stage::None begins.
void nextStageCuda(FrameCounters* counters, Stage ended, Stage begun, CUstream_st* stream);

} // namespace gsc
