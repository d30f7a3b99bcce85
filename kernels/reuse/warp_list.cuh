// SPDX-License-Identifier: Apache-2.0
// A list that warps append to.
#pragma once

#include <cuda_runtime.h>

#include <cstdint>

namespace gsc {

// The place in a list of what a lane appends, if it does. All lanes of the warp call it together.
__device__ __forceinline__ uint32_t appendPlace(bool appends, uint32_t lane, uint32_t* count)
{
    const uint32_t some = __ballot_sync(~0u, appends);
    uint32_t base = 0;
    if (lane == 0 && some != 0)
        base = atomicAdd(count, uint32_t(__popc(some)));
    return __shfl_sync(~0u, base, 0) + __popc(some & ((1u << lane) - 1u));
}

} // namespace gsc
