// SPDX-License-Identifier: Apache-2.0
// Gaussians between their networks and their projection in the tier `fast`. They wait in a ring of their warp's until there
// are enough for every lane: a third to a half of an anchor's are not alive.
#pragma once

#include "kernels/decode/decode_emit.cuh"

namespace gsc {

constexpr uint32_t kOutputs = 10; // of the networks for a Gaussian, but for its opacity

// A warp's ring. kPair: a Gaussian has what the networks gave for each eye; else it has one set of outputs, and an opacity
// for each eye.
template <bool kPair>
struct Waiting {
    static constexpr uint32_t kRoom = kPair ? 109 : 192;                          // 99 KiB for 8 warps: launchDecode()
    static constexpr uint32_t kNew = kRows * 4 * kItemsPerLane / (kPair ? 2 : 1); // at most, of one look
    static_assert(kNew <= kRoom);

    float outputs[kPair ? 2 * (kOutputs + 1) : kOutputs + 2][kRoom]; // before activations; of each set the opacity last
    uint32_t index[kRoom];                                           // anchor * n_offsets + k

    // Of an eye's set, what emitGaussian() takes; `which` kOutputs: the opacity.
    __device__ __forceinline__ float& at(uint32_t eye, uint32_t which, uint32_t i)
    {
        return outputs[kPair ? eye * (kOutputs + 1) + which : which + (which == kOutputs ? eye : 0u)][i];
    }
};

// Which of a ring are taken.
struct WaitingRange {
    uint32_t first = 0, count = 0;

    // Place of entry i, at most kRoom behind the first.
    template <uint32_t kRoom>
    __device__ __forceinline__ uint32_t place(uint32_t i) const
    {
        const uint32_t at = first + i;
        return at < kRoom ? at : at - kRoom;
    }
};

// Emits a warp's Gaussians in rounds of 32 as long as at least `least` (1 to 32) wait. The eyes take turns at a round, so
// that what is the same for both is read once.
template <bool kCompact, bool kShared, bool kThins, bool kPair>
__device__ __forceinline__ void emitWaiting(const DecodeCudaArgs& args, Waiting<kPair>& waiting, WaitingRange& range,
                                            uint32_t least, uint32_t lane, EyeTally& left, EyeTally& right)
{
    constexpr uint32_t kRoom = Waiting<kPair>::kRoom;
    const uint32_t K = args.model.params.n_offsets;
#pragma unroll 1
    while (range.count >= least) {
        const uint32_t count = min(range.count, 32u);
        uint32_t i = range.place<kRoom>(min(lane, count - 1)); // a lane without one reads the last
        keepComputed(i);
        const uint32_t index = waiting.index[i];
        uint32_t anchor = __umulhi(index, args.inverse_offsets); // index / K, or one less
        anchor += index - anchor * K >= K ? 1u : 0u;
        const PlainGaussian plain = plainGaussian<kCompact>(args.model, anchor, index - anchor * K);
        const bool drawn = lane < count && !plain.masked;
        uint32_t slot = kNoSlot, box = kNoBins;
#pragma unroll 1
        for (uint32_t e = 0; e < args.eye_count; ++e) {
            SlotWriter writer = kShared || e == 0 ? left.writer : right.writer;
            const Emitted emitted = emitGaussian<kShared, kThins>(
                args, e, drawn ? waiting.at(e, kOutputs, i) : 0.0f, plain,
                [&](uint32_t which) { return waiting.at(e, which, i); }, e + 1 == args.eye_count, slot, box, lane,
                writer);
            if (e == 0) {
                addTo(left, emitted);
                left.writer = writer;
            } else {
                addTo(right, emitted);
                (kShared ? left : right).writer = writer;
            }
        }
        range.first = range.place<kRoom>(count);
        range.count -= count;
    }
    __syncwarp(); // the ring is written anew
}

} // namespace gsc
