// SPDX-License-Identifier: Apache-2.0
// The Gaussians of an entry: 24 bytes each and key, in kKeptWords words that lie a slot's room apart. Halves of what
// comes before the activations, but for the opacity, which must be told from 1/255 when it is close to 1, too.
//   0  opacity in steps of 1/32767, owner (row | k << 8) of the first key, scale 0 and 1
//   1  rotation
//   2  scale 2, colour
#pragma once

#include "kernels/cuda/halves.cuh"
#include "kernels/decode/decode_emit.cuh"
#include "kernels/reuse/reuse_stages_cuda.h"

namespace gsc {

// A lane's own Gaussian in place of a Staging, whose members it has.
struct StagedLane {
    template <typename T>
    struct Own {
        T value;
        __device__ __forceinline__ T operator[](uint32_t) const { return value; }
        __device__ __forceinline__ T& operator[](uint32_t) { return value; }
    };
    Own<float> scale[3], rotation[4], color[3], opacity;
    Own<uint32_t> owner, slots;
    uint32_t first; // anchor of the strip

    __device__ __forceinline__ uint32_t anchorOf(uint32_t row) const { return first + row; }
};

__device__ __forceinline__ KeptWord* wordsOf(const ReuseTables& tables, uint32_t slot)
{
    return tables.words + size_t(slot) * 2 * kKeptWords * tables.room;
}

// Eyes that see a row of a strip, from ListedStrip::lanes.
__device__ __forceinline__ uint32_t eyesOfRow(uint32_t lanes, uint32_t row)
{
    return (lanes >> row & 1u) | (lanes >> (16 + row) & 1u) << 1;
}

// Opacity factors of a lane's two rows for an eye.
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

// Writes what is staged as a key of an entry.
__device__ __forceinline__ void keepGaussians(const ReuseTables& tables, uint32_t slot, uint32_t key,
                                              const Staging& staged, uint32_t alive, uint32_t lane)
{
    KeptWord* const words = wordsOf(tables, slot) + key * kKeptWords * tables.room;
    for (uint32_t i = lane; i < alive; i += 32) {
        const int opacity = __float2int_rn(fminf(fmaxf(staged.opacity[i], -1.0f), 1.0f) * 32767.0f);
        words[i] = {(uint32_t(opacity) & 0xffffu) | uint32_t(staged.owner[i]) << 16,
                    packHalves(staged.scale[0][i], staged.scale[1][i])};
        words[tables.room + i] = {packHalves(staged.rotation[0][i], staged.rotation[1][i]),
                                  packHalves(staged.rotation[2][i], staged.rotation[3][i])};
        words[2 * tables.room + i] = {packHalves(staged.scale[2][i], staged.color[0][i]),
                                      packHalves(staged.color[1][i], staged.color[2][i])};
    }
}

__device__ __forceinline__ StagedLane loadKey(const KeptWord* words, uint32_t room, uint32_t i)
{
    const KeptWord a = words[i], b = words[room + i], c = words[2 * room + i];
    const float2 s01 = halvesOf(a.high), r01 = halvesOf(b.low), r23 = halvesOf(b.high), s2c0 = halvesOf(c.low),
                 c12 = halvesOf(c.high);
    return {{{s01.x}, {s01.y}, {s2c0.x}},
            {{r01.x}, {r01.y}, {r23.x}, {r23.y}},
            {{s2c0.y}, {c12.x}, {c12.y}},
            {float(int32_t(a.low << 16) >> 16) * (1.0f / 32767.0f)},
            {a.low >> 16},
            {},
            0};
}

// Gaussian i at place `t` between the keys. Precondition: i below the room.
__device__ __forceinline__ StagedLane loadKept(const KeptWord* words, uint32_t room, uint32_t i, float t)
{
    StagedLane kept = loadKey(words, room, i);
    if (t == 0.0f)
        return kept;
    const StagedLane second = loadKey(words + kKeptWords * room, room, i);
    const auto mix = [t](StagedLane::Own<float>& to, const StagedLane::Own<float>& from) {
        to.value = fmaf(t, from.value - to.value, to.value);
    };
#pragma unroll
    for (uint32_t c = 0; c < 3; ++c) {
        mix(kept.scale[c], second.scale[c]);
        mix(kept.color[c], second.color[c]);
    }
#pragma unroll
    for (uint32_t c = 0; c < 4; ++c)
        mix(kept.rotation[c], second.rotation[c]);
    mix(kept.opacity, second.opacity);
    kept.opacity.value = fminf(kept.opacity.value, 1.0f); // beyond a key the line leaves what packSteps() takes
    return kept;
}

} // namespace gsc
