// SPDX-License-Identifier: Apache-2.0
// Lists that warps append to, and counters that they add to.
#pragma once

#include <cuda_runtime.h>

#include <cstdint>

namespace gsc {

// Index in a list at which this lane appends its entry if `appends`; adds the number of such lanes to `count`. All
// lanes of the warp call it together.
__device__ __forceinline__ uint32_t appendPlace(bool appends, uint32_t lane, uint32_t* count)
{
    const uint32_t some = __ballot_sync(~0u, appends);
    uint32_t base = 0;
    if (lane == 0 && some != 0)
        base = atomicAdd(count, uint32_t(__popc(some)));
    return __shfl_sync(~0u, base, 0) + __popc(some & ((1u << lane) - 1u));
}

// Adds the values of all lanes to `counter` with one atomic. All lanes of the warp call it together.
__device__ __forceinline__ void addOfWarp(uint32_t* counter, uint32_t value, uint32_t lane)
{
    const uint32_t sum = __reduce_add_sync(~0u, value);
    if (lane == 0 && sum != 0)
        atomicAdd(counter, sum);
}

// Sum of `value` over the lanes from the first up to this one. All lanes of the warp call it together.
__device__ __forceinline__ uint32_t sumUpTo(uint32_t value)
{
#pragma unroll
    for (uint32_t by = 1; by < 32; by *= 2) {
        const uint32_t left = __shfl_up_sync(~0u, value, by);
        value += (threadIdx.x & 31u) >= by ? left : 0u;
    }
    return value;
}

// Owner of item i, if the items of all lanes are numbered in a row: the first lane whose `sum` is more than i. sum:
// sumUpTo() of the lane's number of items. All lanes of the warp call it together.
__device__ __forceinline__ int ownerOf(uint32_t i, uint32_t sum)
{
    int owner = 0;
#pragma unroll
    for (int by = 16; by != 0; by /= 2)
        if (__shfl_sync(~0u, sum, owner + by - 1) <= i)
            owner += by;
    return owner;
}

// Result of one atomic addition that counted for all lanes of a warp that add to the same counter (peers).
struct SharedAtomic {
    uint32_t first, peers;

    // Value of the counter before this lane's addition, as an atomic of its own would return. The peers call it
    // together.
    __device__ __forceinline__ uint32_t mine() const
    {
        const int leader = __ffs(int(peers)) - 1;
        return __shfl_sync(peers, first, leader) + __popc(peers & ((1u << (threadIdx.x & 31u)) - 1u));
    }
};

// Does counters[kind]++ for every active lane, with one atomic for each value of `kind` in the warp.
__device__ __forceinline__ SharedAtomic shareAtomic(uint32_t* counters, uint32_t kind)
{
    const uint32_t peers = __match_any_sync(__activemask(), kind);
    uint32_t first = 0;
    if ((threadIdx.x & 31u) == uint32_t(__ffs(int(peers)) - 1))
        first = atomicAdd(counters + kind, uint32_t(__popc(peers)));
    return {first, peers};
}

} // namespace gsc
