// SPDX-License-Identifier: Apache-2.0
// Draws the Gaussians of a strip in frames with reuse, for one eye after the other.
#pragma once

#include "kernels/decode/fast/emit.cuh"

namespace gsc {

constexpr uint32_t kStaged = kRows * 4 * kItemsPerLane; // largest number of Gaussians in a strip

// Outputs of the networks for the Gaussians of a strip that are drawn, stored without gaps, so that projecting them
// keeps every lane busy.
struct StagedStrip {
    float outputs[10][kStaged]; // outputs of the networks, in the order in which emitGaussian() takes them
    float opacities[kStaged];
    uint16_t owners[kStaged]; // row | k << 8: row of the Gaussian's anchor, number of its slot
    uint32_t slots[kStaged];  // with shared bins: the splat slot to which the first eye wrote the Gaussian, or kNoSlot
    uint32_t first;           // number of the strip's first anchor

    __device__ __forceinline__ float output(uint32_t which, uint32_t i) const { return outputs[which][i]; }
    __device__ __forceinline__ float opacity(uint32_t i) const { return opacities[i]; }
    __device__ __forceinline__ uint32_t owner(uint32_t i) const { return owners[i]; }
    __device__ __forceinline__ uint32_t& slot(uint32_t i) { return slots[i]; }
};

// Order of the eyes when they share bins and draw a staged strip one after the other: which eye this is.
struct Turns {
    bool first; // true for the first eye: no eye has written the staged Gaussians yet
    bool last;  // true if no other eye follows
};

// Emits those of the `count` staged Gaussians that one eye sees. seen_by, factors: of the two rows of this lane, the
// eyes that see them and their opacity factors. kShared: the first eye leaves in staged.slot(i) where it wrote each Gaussian.
// Staged: StagedStrip, or a type with its members.
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
