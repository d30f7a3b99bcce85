// SPDX-License-Identifier: Apache-2.0
// The last step of decoding in the tier `fast`: what the networks gave for a warp's Gaussians to splats in their slots,
// counted in their cells.
#pragma once

#include "kernels/common/depth_cells.cuh"
#include "kernels/common/slot_writer.cuh"
#include "kernels/decode/decode_fragments.h"
#include "kernels/decode/decode_networks.cuh"
#include "kernels/decode/decode_project.cuh"

namespace gsc {

constexpr uint32_t kRows = 16;                          // anchors per warp and step
constexpr uint32_t kStaged = kRows * 4 * kItemsPerLane; // Gaussians per warp and step at most

// Outputs of the networks for the living Gaussians of a warp's step, packed without gaps so that projecting them keeps
// every lane busy: a third to a half of all Gaussians is not alive.
struct Staging {
    float scale[3][kStaged], rotation[4][kStaged], color[3][kStaged]; // before their activations
    float opacity[kStaged];
    uint32_t owner[kStaged]; // row | k << 8
};

// Slots that a warp reserves at once. Few leave smaller gaps, of which every warp has one; many are waited for less often,
// which is worth the gaps of large frames.
constexpr uint32_t kSmallPiece = 64, kLargePiece = 256, kLargeFrame = 4u << 20;

__host__ __device__ __forceinline__ uint32_t slotPiece(uint32_t slot_capacity)
{
    return slot_capacity < kLargeFrame ? kSmallPiece : kLargePiece;
}

// Slots and counts of one eye, gathered by a warp. Two of them with fixed names, not an array: an index that the
// compiler does not know would put them into local memory.
struct EyeTally {
    SlotWriter writer;
    uint32_t alive = 0, dropped = 0, written = 0; // per lane
    unsigned long long pairs = 0;                 // per lane
};

// Hands a warp's counts in and marks the slots it did not use.
__device__ __forceinline__ void finish(const DecodeCudaArgs& args, uint32_t e, const EyeTally& tally, uint32_t positive,
                                       uint32_t lane)
{
    tally.writer.close(lane, args.places + size_t(e) * args.slot_capacity, args.slot_capacity);
    const uint32_t alive = __reduce_add_sync(~0u, tally.alive), dropped = __reduce_add_sync(~0u, tally.dropped),
                   written = __reduce_add_sync(~0u, tally.written);
    const bool any_positive = __any_sync(~0u, (positive >> e & 1u) != 0);
    unsigned long long pairs = tally.pairs;
    for (uint32_t with = 16; with != 0; with /= 2)
        pairs += __shfl_xor_sync(~0u, pairs, with);
    if (lane != 0)
        return;
    if (pairs != 0)
        atomicAdd(&args.counters->pass.pairs[e], pairs);
    if (alive != 0)
        atomicAdd(&args.counters->gaussians[e], alive);
    if (dropped != 0)
        atomicAdd(&args.counters->dropped[e], dropped);
    if (written != 0)
        atomicAdd(&args.counters->splats[e], written);
    if (any_positive)
        atomicOr(&args.counters->any_positive[e], 1u);
}

// Activates, projects and writes those of the `count` staged Gaussians that one eye sees. seen_by, factors: of this
// lane's rows, eyes and opacity factor; needed where what is staged is not this eye's alone.
__device__ __forceinline__ void emitStaged(const DecodeCudaArgs& args, uint32_t e, const Staging& staged,
                                           uint32_t count, const uint32_t (&anchors)[2], const uint32_t (&seen_by)[2],
                                           const float (&factors)[2], uint32_t lane, EyeTally& tally)
{
    const DeviceModel& model = args.model;
    const EyeParams& eye = args.eyes[e];
    const uint32_t K = model.params.n_offsets;
#pragma unroll 1
    for (uint32_t first = 0; first < count; first += 32) {
        const uint32_t i = first + lane, owner = i < count ? staged.owner[i] : 0u;
        const uint32_t row = owner & 255u, k = owner >> 8;
        const uint32_t a0 = __shfl_sync(~0u, anchors[0], (row & 7u) * 4),
                       a1 = __shfl_sync(~0u, anchors[1], (row & 7u) * 4);
        const uint32_t anchor = row < 8 ? a0 : a1;
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
        if (opacity >= kOpacityFloor) { // tested already, unless it is both eyes'
            const float4 center = reinterpret_cast<const float4*>(model.placement)[anchor];
            const float2* shape = reinterpret_cast<const float2*>(model.shape + size_t(6) * anchor);
            const float2 s0 = shape[0], s1 = shape[1], s2 = shape[2];
            const uint64_t offset = model.offset[size_t(anchor) * K + k];
            const auto steps = [offset](uint32_t axis) {
                return float(int32_t(uint32_t(offset >> (kOffsetBits * axis)) & ((1u << kOffsetBits) - 1u)) -
                             kOffsetSteps - 1);
            };
            const float position[3] = {fmaf(steps(0), s0.x, center.x), fmaf(steps(1), s0.y, center.y),
                                       fmaf(steps(2), s1.x, center.z)};
            const float sigma[3] = {s1.y * sigmoidFast(staged.scale[0][i]), s2.x * sigmoidFast(staged.scale[1][i]),
                                    s2.y * sigmoidFast(staged.scale[2][i])};
            const float rgb[3] = {sigmoidFast(staged.color[0][i]), sigmoidFast(staged.color[1][i]),
                                  sigmoidFast(staged.color[2][i])};
            float q[4], norm = 0.0f;
#pragma unroll
            for (uint32_t c = 0; c < 4; ++c) {
                q[c] = staged.rotation[c][i];
                norm = fmaf(q[c], q[c], norm);
            }
            const float inverse = rsqrtf(fmaxf(norm, 1e-24f));
#pragma unroll
            for (uint32_t c = 0; c < 4; ++c)
                q[c] *= inverse;
            bool finite = offset != kNoOffset;
            const bool here =
                args.pass.count == 1 ||
                passOf(args.pass, args.grid, viewPoint<float>(eye, {position[0], position[1], position[2]}).z) ==
                    args.pass.index;
            if (here) {
                ++tally.alive;
                finite = finite && isfinite(rgb[0] + rgb[1] + rgb[2]); // geometry is for projectFast to see
                drawn = finite && projectFast(args, eye, position, sigma, q, opacity, rgb, model.source[anchor] * K + k,
                                              out, finite);
                tally.dropped += finite ? 0u : 1u;
            }
        }
        const uint32_t slot =
            tally.writer.reserve(drawn, lane, slotPiece(args.slot_capacity), &args.counters->pass.slots[e]);
        if (drawn && slot < args.slot_capacity) {
            ++tally.written;
            tally.pairs += binCount(out.place);
            const size_t at = size_t(e) * args.slot_capacity + slot;
            reinterpret_cast<uint4*>(args.splats + at)[0] = out.words[0];
            reinterpret_cast<uint4*>(args.splats + at)[1] = out.words[1];
            args.places[at] = out.place;
        } else {
            if (drawn)
                atomicOr(&args.counters->overflow, kSlotOverflow);
            out.place.box = kNoBins;
        }
        uint32_t* cells = args.cells + size_t(e) * args.grid.cells();
        forCellsOfWarp(
            args.grid, args.pass.slab_of, out.place, 0, [&](uint32_t cell) { return atomicAdd(cells + cell, 1u); },
            [](uint32_t, uint32_t, uint32_t) {});
    }
}

} // namespace gsc
