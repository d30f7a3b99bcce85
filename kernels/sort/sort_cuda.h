// SPDX-License-Identifier: Apache-2.0
// Sorts the keys in each piece of the bins' lists by depth, on the device.
#pragma once

#include "kernels/frame/device_model.h"
#include "kernels/sort/sort_key.h"

struct CUstream_st;

namespace gsc {

struct SortCudaArgs {
    SortKey* keys; // keys, sorted in place in each piece; afterwards only `slot` has a meaning
    // emission order of the splat in slot 0, in an array of splats; with shared bins the first eye's are used
    const uint32_t* orders;
    bool exact; // true: the splats are ExactSplats; false: PackedSplats
    const Piece* pieces;
    uint32_t piece_capacity;
    FrameCounters* counters;
};

// Sorts each piece from front to back, keys of equal depth by emission order, so that the result does not depend on the
// order in which keys were written. Asynchronous.
void sortCuda(const SortCudaArgs& args, uint32_t processors, CUstream_st* stream);

} // namespace gsc
