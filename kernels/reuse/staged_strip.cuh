// SPDX-License-Identifier: Apache-2.0
// The Gaussians of a strip that frames with reuse draw, for one eye after the other.
#pragma once

#include "kernels/decode/fast/emit.cuh"

namespace gsc {

constexpr uint32_t kStaged = kRows * 4 * kItemsPerLane; // Gaussians of a strip at most

// Outputs of the networks for the living Gaussians of a strip, packed without gaps so that projecting them keeps every
// lane busy.
struct StagedStrip {
    float outputs[10][kStaged]; // the arguments of emitGaussian()
    float opacities[kStaged];
    uint16_t owners[kStaged]; // row | k << 8
    uint32_t slots[kStaged];  // in shared bins: splat slot that the first eye wrote it to, or kNoSlot
    uint32_t first;           // anchor of the strip

    __device__ __forceinline__ float output(uint32_t which, uint32_t i) const { return outputs[which][i]; }
    __device__ __forceinline__ float opacity(uint32_t i) const { return opacities[i]; }
    __device__ __forceinline__ uint32_t owner(uint32_t i) const { return owners[i]; }
    __device__ __forceinline__ uint32_t& slot(uint32_t i) { return slots[i]; }
};

// Turn of one eye at a staged strip, where the eyes share their bins.
struct Turns {
    bool first; // marks the staged Gaussians as not yet written by any eye
    bool last;  // no eye is to follow
};

// Emits those of the `count` staged Gaussians that one eye sees. seen_by, factors: of this lane's rows, eyes and opacity
// factor. kShared: the first eye leaves in the slots what it wrote. Staged: StagedStrip, or what has its members.
template <bool kCompact, bool kShared, bool kThins, typename Staged>
__device__ __forceinline__ void emitStaged(const DecodeCudaArgs& args, uint32_t e, Staged& staged, uint32_t count,
                                           const Turns& turns, const uint32_t (&seen_by)[2], const float (&factors)[2],
                                           uint32_t lane, EyeTally& tally)
{
#pragma unroll 1
    for (uint32_t first = 0; first < count; first += 32) {
        const uint32_t i = first + lane, owner = i < count ? staged.owner(i) : 0u;
        const uint32_t row = owner & 255u, k = owner >> 8;
        float opacity = i < count ? staged.opacity(i) : 0.0f;
        const uint32_t s0 = __shfl_sync(~0u, seen_by[0], (row & 7u) * 4),
                       s1 = __shfl_sync(~0u, seen_by[1], (row & 7u) * 4);
        const float f0 = __shfl_sync(~0u, factors[0], (row & 7u) * 4),
                    f1 = __shfl_sync(~0u, factors[1], (row & 7u) * 4);
        opacity = ((row < 8 ? s0 : s1) >> e & 1u) != 0 ? opacity * (row < 8 ? f0 : f1) : 0.0f;
        uint32_t slot = kNoSlot, box = kNoBins;
        if (kShared && !turns.first && i < count) {
            slot = staged.slot(i);
            if (slot < args.slot_capacity)
                box = args.places[slot].box;
        }
        PlainGaussian plain{};
        if (opacity >= kOpacityFloor)
            plain = plainGaussian<kCompact>(args.model, staged.first + row, k);
        if (plain.masked)
            opacity = 0.0f;
        addTo(tally, emitGaussian<kShared, kThins>(
                         args, e, opacity, plain, [&](uint32_t which) { return staged.output(which, i); }, turns.last,
                         slot, box, lane, tally.writer));
        if (kShared && !turns.last && i < count)
            staged.slot(i) = slot;
    }
}

} // namespace gsc
