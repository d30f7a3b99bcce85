// SPDX-License-Identifier: Apache-2.0
// The order cache on a device: at which depths the keys of the last frame's lists lay. The next frame cuts its lists by
// that (slabCuda()) and not by the depths of its visible anchors alone, of which some have many keys and some none.
#pragma once

#include "kernels/bin/bin_cuda.h"

namespace gsc {

// Of all keys about so many are counted: every nth of the sorted lists, so that each has its share, and two runs count the
// same.
constexpr uint32_t kOrderSamples = 32768;

struct OrderCudaArgs {
    const BinKey* keys; // as the sort leaves them
    const SplatPlace* places;
    uint32_t lists; // per bin
    uint32_t* next; // kDepthBuckets: SlabCudaArgs::next of the frame
    const FrameCounters* counters;
};

// Adds a sample of a frame's keys to `next`; nothing in a frame that will be drawn again. Asynchronous.
void noteOrderCuda(const OrderCudaArgs& args, CUstream_st* stream);

} // namespace gsc
