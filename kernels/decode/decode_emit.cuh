// SPDX-License-Identifier: Apache-2.0
// The last step of decoding in the tier `fast`: what the networks gave for a warp's Gaussians to splats in their slots,
// counted in their cells.
#pragma once

#include "kernels/cuda/anchor_shape.cuh"
#include "kernels/cuda/depth_cells.cuh"
#include "kernels/cuda/slot_writer.cuh"
#include "kernels/cuda/warp_list.cuh"
#include "kernels/decode/decode_fragments.h"
#include "kernels/decode/decode_networks.cuh"
#include "kernels/decode/decode_project.cuh"

namespace gsc {

constexpr uint32_t kRows = 16;                          // anchors per warp and step
constexpr uint32_t kStaged = kRows * 4 * kItemsPerLane; // Gaussians per warp and step at most

constexpr uint32_t kNoSlot = ~0u;

// Outputs of the networks for the living Gaussians of a warp's step, packed without gaps so that projecting them keeps
// every lane busy: a third to a half of all Gaussians is not alive.
struct Staging {
    float scale[3][kStaged], rotation[4][kStaged], color[3][kStaged]; // before their activations
    float opacity[kStaged];
    uint16_t owner[kStaged]; // row | k << 8
    uint32_t slots[kStaged]; // in shared bins: what the first eye has written it to, or kNoSlot
    uint32_t anchors[kRows];

    __device__ __forceinline__ uint32_t anchorOf(uint32_t row) const { return anchors[row]; }
};

// What is to be done for one eye of a step whose eyes share their bins.
struct Turns {
    bool first; // no eye has written anything of what is staged
    bool last;  // no eye is to follow
};

// Slots that a warp reserves at once. Few leave smaller gaps, of which every warp has one; many are waited for less often,
// which is worth the gaps of large frames.
constexpr uint32_t kSmallPiece = 64, kLargePiece = 256, kLargeFrame = 4u << 20;

__host__ __device__ __forceinline__ uint32_t slotPiece(uint32_t slot_capacity)
{
    return slot_capacity < kLargeFrame ? kSmallPiece : kLargePiece;
}

// Slots and counts of one eye, gathered by a warp. Two of them with fixed names, not an array: an index that the
// compiler does not know would put them into local memory. Every register of them is one less for the networks.
struct EyeTally {
    SlotWriter writer;
    uint32_t alive = 0, written = 0, pairs = 0; // per lane
};

// Hands a warp's counts in and marks the slots it did not use. kShared: the first eye's writer is that of both.
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

// Bins of both boxes. Precondition: neither is kNoBins.
__device__ __forceinline__ uint32_t boxAround(uint32_t a, uint32_t b)
{
    return (__vminu4(a, b) & 0xffffu) | (__vmaxu4(a, b) & 0xffff0000u);
}

// Is it so thin that FastRules::box() may not bound it? With as much to spare as rounding takes.
__device__ __forceinline__ bool isNeedle(const Candidate& splat)
{
    const float b = __uint_as_float(splat.words[0].w), c = __uint_as_float(splat.words[1].x);
    return !(c * c > 2 * kTrustedDeterminant * (b * b + c * c));
}

// A slot that an eye does not see: a splat of some pixels that no image holds.
__device__ __forceinline__ void writeUnseen(const DecodeCudaArgs& args, uint32_t e, uint32_t slot, uint32_t order)
{
    const uint32_t one = __float_as_uint(1.0f), far_off = __float_as_uint(kUnseenPlace);
    uint4* const to = reinterpret_cast<uint4*>(args.splats + size_t(e) * args.slot_capacity + slot);
    to[0] = {far_off, far_off, one, 0};
    to[1] = {one, 0, 0xffff0000u, order};
    args.touches[touchPlace(true, e, slot)] = uint16_t(kTouchUnknown);
}

// True if there was something to write and room for it.
template <bool kShared>
__device__ __forceinline__ bool writeSplat(const DecodeCudaArgs& args, uint32_t e, bool drawn, uint32_t slot,
                                           const Candidate& splat, EyeTally& tally)
{
    if (!drawn)
        return false;
    if (slot >= args.slot_capacity) {
        atomicOr(&args.counters->overflow, kSlotOverflow);
        return false;
    }
    ++tally.written;
    uint4* const to = reinterpret_cast<uint4*>(args.splats + size_t(e) * args.slot_capacity + slot);
    to[0] = splat.words[0];
    to[1] = splat.words[1];
    args.touches[touchPlace(kShared, e, kShared ? slot : e * args.slot_capacity + slot)] = uint16_t(splat.touch);
    return true;
}

// Counts a splat in the cells of its list. All lanes of the warp call it together, with kNoBins for nothing.
__device__ __forceinline__ void countCells(const DecodeFrame& args, uint32_t list, const SplatPlace& place,
                                           EyeTally& tally)
{
    if (place.box != kNoBins)
        tally.pairs += binCount(place.box);
    uint32_t* cells = args.cells + size_t(list) * args.grid.cells();
    const auto count = [&](uint32_t cell) { return atomicAdd(cells + cell, 1u); };
    forCellsOfWarp<1>(args.grid, args.pass.slab_of, place, 0, count, count, [](uint32_t, uint32_t, uint32_t) {});
}

// Activates, projects and writes those of the `count` staged Gaussians that one eye sees. seen_by, factors: of this
// lane's rows, eyes and opacity factor; needed where what is staged is not this eye's alone. kShared: the eyes share their
// bins. The first leaves in Staging::slots what it wrote, the last gives each slot its place and counts it. A Gaussian
// takes a slot for each eye where a box round both would be larger than both together, and where blending could not tell
// that it ends within an eye's own box (isNeedle()). Two such slots may meet in a bin; no eye sees both. Staged: Staging, or
// what has its members.
template <bool kCompact, bool kShared, bool kThins, typename Staged>
__device__ __forceinline__ void emitStaged(const DecodeCudaArgs& args, uint32_t e, Staged& staged, uint32_t count,
                                           const Turns& turns, const uint32_t (&seen_by)[2], const float (&factors)[2],
                                           uint32_t lane, EyeTally& tally)
{
    const DeviceModel& model = args.model;
    const EyeParams& eye = args.eyes[e];
    const uint32_t K = model.params.n_offsets;
#pragma unroll 1
    for (uint32_t first = 0; first < count; first += 32) {
        const uint32_t i = first + lane, owner = i < count ? staged.owner[i] : 0u;
        const uint32_t row = owner & 255u, k = owner >> 8;
        const uint32_t anchor = staged.anchorOf(row);
        float opacity = i < count ? staged.opacity[i] : 0.0f;
        if (args.merged) {
            const uint32_t s0 = __shfl_sync(~0u, seen_by[0], (row & 7u) * 4),
                           s1 = __shfl_sync(~0u, seen_by[1], (row & 7u) * 4);
            const float f0 = __shfl_sync(~0u, factors[0], (row & 7u) * 4),
                        f1 = __shfl_sync(~0u, factors[1], (row & 7u) * 4);
            opacity = ((row < 8 ? s0 : s1) >> e & 1u) != 0 ? opacity * (row < 8 ? f0 : f1) : 0.0f;
        }
        Candidate out;
        bool drawn = false;
        uint32_t slot = kNoSlot;    // of the first eye, then this one's
        uint32_t earlier = kNoBins; // the box that the first eye gave it
        if (kShared && !turns.first && i < count) {
            slot = staged.slots[i];
            if (slot < args.slot_capacity)
                earlier = args.places[slot].box;
        }
        if (opacity >= kOpacityFloor) { // tested already, unless it is both eyes'
            const float4 center = reinterpret_cast<const float4*>(model.placement)[anchor];
            const AnchorShape shape = anchorShape<kCompact>(model, anchor);
            const OffsetSteps offset = offsetSteps<kCompact>(model, anchor, k);
            const uint32_t order = model.source[anchor] * K + k;
            const float position[3] = {fmaf(offset.along[0], shape.step[0], center.x),
                                       fmaf(offset.along[1], shape.step[1], center.y),
                                       fmaf(offset.along[2], shape.step[2], center.z)};
            const float sigma[3] = {shape.extent[0] * sigmoidFast(staged.scale[0][i]),
                                    shape.extent[1] * sigmoidFast(staged.scale[1][i]),
                                    shape.extent[2] * sigmoidFast(staged.scale[2][i])};
            const float rgb[3] = {sigmoidFast(staged.color[0][i]), sigmoidFast(staged.color[1][i]),
                                  sigmoidFast(staged.color[2][i])};
            float q[4], norm = 0.0f;
#pragma unroll
            for (uint32_t c = 0; c < 4; ++c) {
                q[c] = staged.rotation[c][i];
                norm = fmaf(q[c], q[c], norm);
            }
            const float inverse = rsqrtf(0.5f * fmaxf(norm, 1e-24f)); // projectFast()
#pragma unroll
            for (uint32_t c = 0; c < 4; ++c)
                q[c] *= inverse;
            const bool here =
                !offset.masked &&
                (args.pass.count == 1 ||
                 passOf(args.pass, args.grid, viewPoint<float>(eye, {position[0], position[1], position[2]}).z) ==
                     args.pass.index);
            if (here) {
                ++tally.alive;
                bool finite; // its geometry
                drawn = projectFast<kThins>(args, e, position, sigma, q, opacity, rgb, order, out, finite);
                finite = finite && offset.finite && isfinite(rgb[0] + rgb[1] + rgb[2]);
                drawn = drawn && finite;
                if (!finite) // rare
                    atomicAdd(&args.counters->dropped[e], 1u);
            }
        }
        if constexpr (!kShared) {
            slot = tally.writer.reserve(drawn, lane, slotPiece(args.slot_capacity), &args.counters->pass.slots[e]);
            if (writeSplat<kShared>(args, e, drawn, slot, out, tally))
                args.places[size_t(e) * args.slot_capacity + slot] = out.place;
            else
                out.place.box = kNoBins;
            countCells(args, e, out.place, tally);
        } else {
            if (drawn)
                out.place.box += args.grid.shift[e] * 0x00010001u;
            const bool again = earlier != kNoBins;
            const uint32_t around = again && drawn ? boxAround(earlier, out.place.box) : 0u;
            const bool wider = around != earlier || around != out.place.box;
            const bool apart = again && drawn && wider &&
                               (binCount(around) > binCount(earlier) + binCount(out.place.box) || isNeedle(out));
            const bool fresh = drawn && (slot == kNoSlot || apart);
            SplatPlace first_alone{0, kNoBins};
            if (again && (!drawn || apart)) {
                writeUnseen(args, e, slot, 0); // its order is read from the first eye's row
                first_alone = args.places[slot];
            }
            const uint32_t reserved =
                tally.writer.reserve(fresh, lane, slotPiece(args.slot_capacity), &args.counters->pass.slots[0]);
            slot = fresh ? reserved : slot;
            if (writeSplat<kShared>(args, e, drawn, slot, out, tally)) {
                if (fresh && turns.last)
                    writeUnseen(args, 1 - e, slot, out.words[1].w);
                if (!fresh)
                    out.place.box = around;
                if (fresh || around != earlier)
                    args.places[slot] = out.place;
            } else {
                out.place.box = kNoBins;
            }
            if (turns.last) {
                // note: a loop, rarely of two rounds, so that this long code is there once
                for (bool more = true; more; out.place = first_alone, first_alone.box = kNoBins) {
                    countCells(args, 0, out.place, tally);
                    more = __any_sync(~0u, first_alone.box != kNoBins);
                }
            } else if (i < count) {
                staged.slots[i] = drawn ? slot : kNoSlot;
            }
        }
    }
}

} // namespace gsc
