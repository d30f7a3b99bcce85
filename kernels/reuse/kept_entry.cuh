// SPDX-License-Identifier: Apache-2.0
// The Gaussians of an entry: 24 bytes each, in kKeptWords words; word w of all Gaussians lies behind word w - 1 of all. Values
// are halves from before the activations; the opacity has finer steps, for values near 1/255 and near 1 alike.
//   0  opacity in steps of 1/32767, owner (row | k << 8), scale 0 and 1
//   1  rotation
//   2  scale 2, colour
#pragma once

#include "kernels/cuda/halves.cuh"
#include "kernels/reuse/reuse_stages_cuda.h"
#include "kernels/reuse/staged_strip.cuh"

namespace gsc {

// One Gaussian of a lane, with the members of a StagedStrip, in whose place it is used.
struct StagedLane {
    float outputs[10], its_opacity;
    uint32_t its_owner, its_slot;
    uint32_t first;

    __device__ __forceinline__ float output(uint32_t which, uint32_t) const { return outputs[which]; }
    __device__ __forceinline__ float opacity(uint32_t) const { return its_opacity; }
    __device__ __forceinline__ uint32_t owner(uint32_t) const { return its_owner; }
    __device__ __forceinline__ uint32_t& slot(uint32_t) { return its_slot; }
};

__device__ __forceinline__ KeptWord* wordsOf(const ReuseTables& tables, uint32_t slot)
{
    return tables.words + size_t(slot) * kKeptWords * tables.room;
}

// Eyes that see a row of a strip, a bit each, from ListedStrip::lanes.
__device__ __forceinline__ uint32_t eyesOfRow(uint32_t lanes, uint32_t row)
{
    return (lanes >> row & 1u) | (lanes >> (16 + row) & 1u) << 1;
}

// Opacity factors of a lane's two rows for one eye.
__device__ __forceinline__ void keptFactors(const float* fraction, uint32_t index, uint32_t eye, uint32_t lane,
                                            float (&factors)[2])
{
    factors[0] = factors[1] = 1.0f;
    if (fraction == nullptr)
        return;
    const float* of = fraction + (size_t(index) * kMaxEyes + eye) * kStripAnchors + (lane >> 2);
    factors[0] = of[0];
    factors[1] = of[8];
}

// Writes the staged Gaussians of a strip into the entry with this cache slot.
__device__ __forceinline__ void keepGaussians(const ReuseTables& tables, uint32_t slot, const StagedStrip& staged,
                                              uint32_t alive, uint32_t lane)
{
    KeptWord* const words = wordsOf(tables, slot);
    for (uint32_t i = lane; i < alive; i += 32) {
        const int opacity = __float2int_rn(fminf(fmaxf(staged.opacities[i], -1.0f), 1.0f) * 32767.0f);
        const auto halves = [&](uint32_t low, uint32_t high) {
            return packHalves(staged.output(low, i), staged.output(high, i));
        };
        words[i] = {(uint32_t(opacity) & 0xffffu) | uint32_t(staged.owners[i]) << 16, halves(0, 1)};
        words[tables.room + i] = {halves(3, 4), halves(5, 6)};
        words[2 * tables.room + i] = {halves(2, 7), halves(8, 9)};
    }
}

// Gaussian i of an entry. Precondition: i is below `room`.
__device__ __forceinline__ StagedLane loadKept(const KeptWord* words, uint32_t room, uint32_t i)
{
    const KeptWord a = words[i], b = words[room + i], c = words[2 * room + i];
    const float2 s01 = halvesOf(a.high), r01 = halvesOf(b.low), r23 = halvesOf(b.high), s2c0 = halvesOf(c.low),
                 c12 = halvesOf(c.high);
    return {{s01.x, s01.y, s2c0.x, r01.x, r01.y, r23.x, r23.y, s2c0.y, c12.x, c12.y},
            float(int32_t(a.low << 16) >> 16) * (1.0f / 32767.0f),
            a.low >> 16,
            kNoSlot,
            0};
}

} // namespace gsc
