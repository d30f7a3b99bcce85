// SPDX-License-Identifier: Apache-2.0
// Sorts keys in the registers of a team of warps with a sorting network.
#pragma once

#include "kernels/cuda/ptx.cuh"

#include <cuda_runtime.h>

namespace gsc {

// A team that is one warp.
struct SortWarp {
    static constexpr bool kOneWarp = true;
    static constexpr uint32_t threads = 32;

    uint32_t thread;

    __device__ __forceinline__ void sync() const { __syncwarp(); }
    __device__ __forceinline__ bool any(bool value) const
    {
        __syncwarp(); // needed since a vote alone does not order accesses to memory
        return __any_sync(~0u, value);
    }
};

// A team of several warps of a block; their number is a power of two.
struct SortTeam {
    static constexpr bool kOneWarp = false;

    uint32_t threads, thread, barrier;

    __device__ __forceinline__ void sync() const { barrierSync(barrier, threads); }
    __device__ __forceinline__ bool any(bool value) const { return barrierAny(barrier, threads, value); }
};

__device__ __forceinline__ void exchangeKeys(uint32_t& a, uint32_t& b)
{
    const uint32_t low = min(a, b);
    b = max(a, b);
    a = low;
}

// Merges the two sorted halves of every `size` keys that a thread has in a row.
template <uint32_t kItems>
__device__ __forceinline__ void mergeInThread(uint32_t (&keys)[kItems], uint32_t size)
{
#pragma unroll
    for (uint32_t first = 0; first < kItems; first += size)
#pragma unroll
        for (uint32_t i = 0; i < size / 2; ++i)
            exchangeKeys(keys[first + i], keys[first + size - 1 - i]);
}

// Exchanges keys of a thread that are `distance` apart if they are out of order.
template <uint32_t kItems>
__device__ __forceinline__ void cleanInThread(uint32_t (&keys)[kItems], uint32_t distance)
{
#pragma unroll
    for (uint32_t i = 0; i < kItems; ++i)
        if ((i & distance) == 0)
            exchangeKeys(keys[i], keys[i + distance]);
}

// Compares the keys of this thread with those of thread `t ^ with`: key by key or, if mirrored, the first with the
// last. The thread with the lower number keeps the smaller keys. room: shared memory for kItems keys of each thread,
// used if the two threads are not in one warp.
template <bool kMirrored, uint32_t kItems, typename Team>
__device__ __forceinline__ void exchangeWith(uint32_t (&keys)[kItems], uint32_t with, uint32_t* room, const Team& team)
{
    const bool upper = (team.thread ^ with) < team.thread;
    uint32_t theirs[kItems];
    if (Team::kOneWarp || with < 32) {
#pragma unroll
        for (uint32_t i = 0; i < kItems; ++i)
            theirs[i] = __shfl_xor_sync(~0u, keys[kMirrored ? kItems - 1 - i : i], int(with));
    } else {
        team.sync();
#pragma unroll
        for (uint32_t i = 0; i < kItems; ++i)
            room[i * team.threads + team.thread] = keys[i];
        team.sync();
#pragma unroll
        for (uint32_t i = 0; i < kItems; ++i)
            theirs[i] = room[(kMirrored ? kItems - 1 - i : i) * team.threads + (team.thread ^ with)];
    }
#pragma unroll
    for (uint32_t i = 0; i < kItems; ++i)
        // correct since no two keys are equal, except those that fill up
        keys[i] = (theirs[i] < keys[i]) != upper ? theirs[i] : keys[i];
}

// Sorts the keys of a team; key i of thread t has number t kItems + i. It is a bitonic sort (Batcher 1968) whose merges
// begin with the second half mirrored, so that every comparison puts the smaller key first.
template <uint32_t kItems, typename Team>
__device__ __forceinline__ void sortInRegisters(uint32_t (&keys)[kItems], uint32_t* room, const Team& team)
{
#pragma unroll
    for (uint32_t size = 2; size <= kItems; size *= 2) {
        mergeInThread(keys, size);
#pragma unroll
        for (uint32_t distance = size / 4; distance > 0; distance /= 2)
            cleanInThread(keys, distance);
    }
    // note: not unrolled, since the code of all teams would not fit the instruction cache
#pragma unroll 1
    for (uint32_t threads = 2; threads <= team.threads; threads *= 2) {
        exchangeWith<true>(keys, threads - 1, room, team);
#pragma unroll 1
        for (uint32_t distance = threads / 4; distance > 0; distance /= 2)
            exchangeWith<false>(keys, distance, room, team);
#pragma unroll
        for (uint32_t distance = kItems / 2; distance > 0; distance /= 2)
            cleanInThread(keys, distance);
    }
}

} // namespace gsc
