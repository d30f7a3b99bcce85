// SPDX-License-Identifier: Apache-2.0
// Depth order within the pieces of the bins' lists, on the device.
#pragma once

#include "kernels/frame/device_model.h"
#include "kernels/sort/sort_key.h"

struct CUstream_st;

namespace gsc {

struct SortCudaArgs {
    SortKey* keys;          // sorted in place piece by piece; afterwards only `slot` means something
    const uint32_t* orders; // emission order of the splat in slot 0; in shared bins the first eye's tell the order
    bool exact;             // slots are ExactSplats, not PackedSplats
    const Piece* pieces;
    uint32_t piece_capacity;
    FrameCounters* counters;
};

// Front to back, equal depths by emission order, so that the result does not depend on the order of the keys before.
// Asynchronous.
void sortCuda(const SortCudaArgs& args, uint32_t processors, CUstream_st* stream);

} // namespace gsc
