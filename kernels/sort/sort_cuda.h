// SPDX-License-Identifier: Apache-2.0
// Depth order within the pieces of the bins' lists, on the device.
#pragma once

#include "kernels/bin/bin_cuda.h"
#include "kernels/decode/decode_cuda.h"

namespace gsc {

struct SortCudaArgs {
    BinKey* keys;       // sorted in place piece by piece; afterwards only `slot` means something
    const void* splats; // PackedSplat or ExactSplat of all eyes; in shared bins the first eye's tell the order
    const Piece* pieces;
    uint32_t piece_capacity;
    FrameCounters* counters;
};

// Raises the shared-memory limits of the kernels; once per device. Throws Error (Unsupported if the build has no code for
// the device).
void prepareSortCuda();

// Front to back, equal depths by emission order, so that the result does not depend on the order of the keys before.
// Asynchronous.
void sortFastCuda(const SortCudaArgs& args, uint32_t processors, CUstream_st* stream);
void sortExactCuda(const SortCudaArgs& args, uint32_t processors, CUstream_st* stream);

} // namespace gsc
