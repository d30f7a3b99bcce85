// SPDX-License-Identifier: Apache-2.0
// Hands out splat slots to a warp's decoded Gaussians, and counts them and their cells, in both tiers.
#pragma once

#include "kernels/cuda/depth_cells.cuh"
#include "kernels/cuda/warp_list.cuh"
#include "kernels/decode/decode_cuda.h"

namespace gsc {

// Hands out slots of a shared output array to a warp, in large pieces: one atomic per piece instead of one per write.
struct SlotWriter {
    uint32_t next = 0, left = 0; // next: first free slot of the piece; left: free slots in it; equal in every lane

    // Returns a slot for each lane that wants one. size: slots of a piece, at least 32; cursor: end of the slots handed
    // out so far. All lanes of the warp call it together.
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

    // Marks the slots that were reserved but not written.
    __device__ __forceinline__ void close(uint32_t lane, SplatPlace* places, uint32_t capacity) const
    {
        for (uint32_t i = lane; i < left; i += 32)
            if (next + i < capacity)
                places[next + i].box = kNoBins;
    }
};

// Number of slots that a warp reserves at once. Small pieces leave smaller gaps, of which each warp has one; large ones
// are waited for less often, which is worth their gaps in large frames.
constexpr uint32_t kSmallPiece = 64, kLargePiece = 256, kLargeFrame = 4u << 20;

__host__ __device__ __forceinline__ uint32_t slotPiece(uint32_t slot_capacity)
{
    return slot_capacity < kLargeFrame ? kSmallPiece : kLargePiece;
}

// Slots and counts of one eye, gathered by a warp. There are two variables and no array of two: an index that the
// compiler does not know would put an array into local memory.
struct EyeTally {
    SlotWriter writer;
    uint32_t alive = 0, written = 0,
             pairs = 0; // counts of this lane: Gaussians alive, splats written, (bin, splat) pairs
};

// Adds a warp's counts to those of the frame, and marks the slots that the warp did not use. kShared: the writer of the
// first eye is that of both.
template <bool kShared>
__device__ __forceinline__ void finish(const DecodeFrame& args, uint32_t e, const EyeTally& tally, uint32_t positive,
                                       uint32_t lane)
{
    if (!kShared || e == 0)
        tally.writer.close(lane, args.places + size_t(e) * args.slot_capacity, args.slot_capacity);
    addOfWarp(&args.counters->gaussians[e], tally.alive, lane);
    addOfWarp(&args.counters->splats[e], tally.written, lane);
    const bool any_positive = __any_sync(~0u, (positive >> e & 1u) != 0);
    unsigned long long pairs = tally.pairs;
    for (uint32_t with = 16; with != 0; with /= 2)
        pairs += __shfl_xor_sync(~0u, pairs, with);
    if (lane != 0)
        return;
    if ((!kShared || e == 0) && tally.writer.left != 0)
        atomicAdd(&args.counters->pass.gaps[e], tally.writer.left);
    if (pairs != 0)
        atomicAdd(&args.counters->pass.pairs[kShared ? 0 : e], pairs);
    if (any_positive)
        atomicOr(&args.counters->any_positive[e], 1u);
}

// Counts a splat in the cells of its list, and returns the number of cells. All lanes of the warp call it together;
// those without a splat pass kNoBins.
__device__ __forceinline__ uint32_t countCells(const DecodeFrame& args, uint32_t list, const SplatPlace& place)
{
    uint32_t* cells = args.cells + size_t(list) * args.grid.cells();
    const auto count = [&](uint32_t cell) { return atomicAdd(cells + cell, 1u); };
    forCellsOfWarp<1>(args.grid, args.pass.slab_of, place, 0, count, count, [](uint32_t, uint32_t, uint32_t) {});
    return place.box != kNoBins ? binCount(place.box) : 0u;
}

} // namespace gsc
