// SPDX-License-Identifier: Apache-2.0
// Measures how long the stages of a frame take, with the device's own clock: a kernel of one thread runs between two
// stages. An event in a captured graph does this too, but takes seven times as much of the device's time and 1.5 us of
// the host's.
#pragma once

#include "kernels/frame/device_model.h"

struct CUstream_st;

namespace gsc {

// Starts the clock, which writes its times to the counters of the frame. Asynchronous, like the kernels of the stages.
void startClockCuda(FrameCounters* counters, CUstream_st* stream); // begins Stage::Select
// Ends one stage and begins another; after the last stage `begun` is Stage::None.
void nextStageCuda(FrameCounters* counters, Stage ended, Stage begun, CUstream_st* stream);

} // namespace gsc
