// SPDX-License-Identifier: Apache-2.0
// Slots of a shared output array, handed out to a warp in large pieces: one atomic per piece instead of one per write.
#pragma once

#include "kernels/frame/device_model.h"

#include <cuda_runtime.h>

namespace gsc {

struct SlotWriter {
    uint32_t next = 0, left = 0; // the same in every lane

    // Slot of each lane that wants one, from pieces of `size`, at least 32. All lanes of the warp call it together.
    __device__ __forceinline__ uint32_t reserve(bool wanted, uint32_t lane, uint32_t size, uint32_t* cursor)
    {
        const uint32_t mask = __ballot_sync(~0u, wanted);
        const uint32_t count = __popc(mask), rank = __popc(mask & ((1u << lane) - 1u));
        uint32_t slot = next + rank;
        if (count > left) {
            uint32_t piece = 0;
            if (lane == 0)
                piece = atomicAdd(cursor, size);
            piece = __shfl_sync(~0u, piece, 0);
            if (rank >= left)
                slot = piece + rank - left;
            next = piece + count - left;
            left = size - (count - left);
        } else {
            next += count;
            left -= count;
        }
        return slot;
    }

    // Marks the slots that were reserved and not written.
    __device__ __forceinline__ void close(uint32_t lane, SplatPlace* places, uint32_t capacity) const
    {
        for (uint32_t i = lane; i < left; i += 32)
            if (next + i < capacity)
                places[next + i].box = kNoBins;
    }
};

} // namespace gsc
