// SPDX-License-Identifier: Apache-2.0
// What a frame that is drawn again draws: what was decided the first time, for a list in another order. What no slot took
// is decoded again.
#pragma once

#include "kernels/cuda/warp_list.cuh"
#include "kernels/reuse/reuse_cuda.h"

namespace gsc {

// Entry `i` of the list. All lanes of the warp call it together, with places past the end of the list for nothing.
__device__ __forceinline__ void drawAgain(const ReuseTables& tables, uint32_t i, uint32_t lane)
{
    Want want{};
    if (i < tables.scratch->counters.strips) {
        want.strip = tables.listed[i];
        const DrawnSlots decided = tables.decided[want.strip.strip];
        tables.drawn[i] = decided;
#pragma unroll
        for (uint32_t e = 0; e < kMaxEyes; ++e)
            if ((want.strip.lanes >> (16 * e) & 0xffffu) != 0 && decided.slot[e] == kNoEntry)
                want.eyes |= 1u << e;
    }
    const uint32_t at = appendPlace(want.eyes != 0, lane, &tables.scratch->counters.wants);
    if (want.eyes == 0)
        return;
    want.eye = want.eyes >> 1 & ~want.eyes & 1u;
    want.index = i;
    want.bucket = kMust;
    want.keys.count = 1;
    tables.wants[at] = want;
}

} // namespace gsc
