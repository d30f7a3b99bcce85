// SPDX-License-Identifier: Apache-2.0
// Decoder of the tier `fast`, compiled for both layouts of a model (decode_fast.cu, decode_compact.cu). A third to a
// half of an anchor's Gaussians have no opacity and are dropped behind the networks. The others wait in a ring of their
// warp until there are enough to give one to every lane, and are then projected.
#pragma once

#include "kernels/cuda/launch.cuh"
#include "kernels/decode/fast/emit.cuh"
#include "kernels/decode/fast/networks.cuh"

#include <algorithm>
#include <type_traits>

namespace gsc {

constexpr uint32_t kOutputs = 10; // outputs of the networks for a Gaussian, without its opacity

// Ring of Gaussians that wait in a warp. kPair: a Gaussian has the networks' outputs for each eye; otherwise one set of
// outputs, and an opacity for each eye.
template <bool kPair>
struct Waiting {
    static constexpr uint32_t kRoom = kPair ? 109 : 192; // entries of a ring: 8 warps take 99 KiB (launchDecode())
    // largest number of new Gaussians from one call of decodeRows()
    static constexpr uint32_t kNew = kRows * 4 * kItemsPerLane / (kPair ? 2 : 1);
    static_assert(kNew <= kRoom);

    // outputs before activations; in each set the opacity is last
    float outputs[kPair ? 2 * (kOutputs + 1) : kOutputs + 2][kRoom];
    uint32_t index[kRoom]; // anchor * n_offsets + k of the Gaussian

    // Output `which` of entry i for an eye, numbered as emitGaussian() has it; kOutputs is the opacity.
    __device__ __forceinline__ float& at(uint32_t eye, uint32_t which, uint32_t i)
    {
        return outputs[kPair ? eye * (kOutputs + 1) + which : which + (which == kOutputs ? eye : 0u)][i];
    }
};

// Range of a ring's entries that hold a Gaussian.
struct WaitingRange {
    uint32_t first = 0, count = 0;

    // Place in the ring of entry i of the range; i is at most kRoom.
    template <uint32_t kRoom>
    __device__ __forceinline__ uint32_t place(uint32_t i) const
    {
        const uint32_t at = first + i;
        return at < kRoom ? at : at - kRoom;
    }
};

// Emits the Gaussians of a warp's ring in rounds of 32, as long as `least` (1 to 32) or more wait. In a round one eye
// is drawn after the other, so that values common to both are read once.
template <bool kCompact, bool kShared, bool kThins, bool kPair>
__device__ __forceinline__ void emitWaiting(const DecodeCudaArgs& args, Waiting<kPair>& waiting, WaitingRange& range,
                                            uint32_t least, uint32_t lane, EyeTally& left, EyeTally& right)
{
    constexpr uint32_t kRoom = Waiting<kPair>::kRoom;
    const uint32_t K = args.model.params.n_offsets;
#pragma unroll 1
    while (range.count >= least) {
        const uint32_t count = min(range.count, 32u);
        uint32_t i = range.place<kRoom>(min(lane, count - 1)); // a lane without a Gaussian reads the last one
        keepComputed(i);
        const uint32_t index = waiting.index[i];
        uint32_t anchor = __umulhi(index, args.inverse_offsets); // number of the anchor, index / K, or one less
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
    __syncwarp(); // waits before the ring is written again
}

// Prefetches what decoding reads of 16 anchors: lanes i and i + 16 do so for entry i. The data are needed in the next
// step, and have come from memory by then.
template <bool kCompact>
__device__ __forceinline__ void askForAnchors(const DecodeCudaArgs& args, uint32_t entry, uint32_t lane)
{
    const DeviceModel& model = args.model;
    const uint32_t half = lane >> 4, K = model.params.n_offsets;
    const size_t anchor = entry & ((1u << kAnchorBits) - 1u);
    const auto ask = [anchor](const void* array, uint32_t bytes, uint32_t at) {
        prefetchGlobal(static_cast<const char*>(array) + anchor * bytes + at);
    };
    if constexpr (!kCompact) {
        ask(model.feature, 2 * kFastFeatures, 32 * half);
        ask(model.offset, 8 * K, half * (8 * K - 1)); // up to 96 bytes; a third is no longer than a sector of memory
        ask(model.offset, 8 * K, (1 + half) * (8 * K - 1) / 3);
        ask(model.shape, 24, 23 * half);
    } else {
        ask(model.compact_offset, 4 * K, half * (4 * K - 1)); // prefetches up to 48 bytes
        ask(model.size, 12, 11 * half);
        if (half == 0)
            ask(model.compact_feature, kFastFeatures, 0);
        else
            ask(model.compact_shape, 8, 0);
    }
    if (half == 0)
        ask(model.placement, 16, 0);
    else
        ask(model.source, 4, 0);
}

// The two rows of a lane among the 16 of a warp: anchor, eyes that see it, fractions of its level.
struct Rows {
    uint32_t anchors[2], seen_by[2]; // seen_by: a bit for each eye, 0: no anchor
    float fractions[2][2];           // one for each eye of a row, or only for the eye that the row is for
};

// Decodes 16 rows and adds the Gaussians that are kept to the ring, which must have room. kPair: the two rows of a lane
// are one anchor seen from each eye; otherwise two anchors, seen from one place. positive: gets a bit for each eye that
// sees an opacity above zero.
template <bool kCompact, bool kBank, bool kPair>
__device__ __forceinline__ void decodeRows(const DecodeCudaArgs& args, const DecodeNetworks& networks, const Rows& rows,
                                           uint32_t lane, Waiting<kPair>& waiting, WaitingRange& range,
                                           uint32_t& positive)
{
    const DeviceModel& model = args.model;
    const uint32_t K = model.params.n_offsets, t = lane & 3u;
    uint32_t hidden[6][4];
    {
        float positions[2][3], levels[2];
        uint32_t feature[2][4]; // an anchor's features, for each k tile
#pragma unroll
        for (uint32_t r = 0; r < 2; ++r) {
            const float4 p = reinterpret_cast<const float4*>(model.placement)[rows.anchors[r]];
            positions[r][0] = p.x;
            positions[r][1] = p.y;
            positions[r][2] = p.z;
        }
        gatherInputs<kCompact>(args, rows.anchors, t, feature, levels);
        // zeros that the compiler cannot know; otherwise it would copy the features for each product
        const uint32_t nothing[2] = {args.eye_count >> 2, args.eye_count >> 3};
#pragma unroll
        for (uint32_t i = 0; i < 8; ++i)
            feature[i / 4][i % 4] ^= nothing[i % 2];
        const float* const one = args.merged ? args.look_from : args.eyes[0].center;
        const float* const centers[2] = {kPair ? args.eyes[0].center : one, kPair ? args.eyes[1].center : one};
        firstLayer<kBank>(args, networks, lane, positions, centers, feature, levels, hidden);
    }
    constexpr uint32_t kSlots = kPair ? kItemsPerLane : 2 * kItemsPerLane; // Gaussians of a lane, kept or not
    constexpr uint32_t kEyes = kPair ? 1 : 2;                              // largest number of eyes that see a row
    uint32_t keep = 0, at[kSlots]; // keep: a bit for each Gaussian that is kept; at: place of each in the ring
    {
        float opacity[kOpacityTiles][4]; // zero for slots that the model lacks: their weights and bias are zero
        opacityLayer(networks, lane, hidden, opacity);
        float of_eye[2][kSlots];
#pragma unroll
        for (uint32_t r = 0; r < 2; ++r)
#pragma unroll
            for (uint32_t i = 0; i < kEyes; ++i) {
                const uint32_t e = kPair ? r : i;
                const bool seen = (rows.seen_by[r] >> e & 1u) != 0;
                float most = 0.0f;
#pragma unroll
                for (uint32_t item = 0; item < kItemsPerLane; ++item) {
                    const uint32_t slot = kPair ? item : kItemsPerLane * r + item;
                    float o = value(opacity, item, r);
                    if (args.fraction != nullptr)
                        o *= rows.fractions[r][i];
                    o = seen ? o : 0.0f;
                    of_eye[e][slot] = o;
                    most = fmaxf(most, o);
                    keep |= o >= kOpacityFloor ? 1u << slot : 0u;
                }
                positive |= most > 0.0f ? 1u << e : 0u;
            }
        const uint32_t alive = stagingIndices(keep, lane, at);
        if (alive == 0)
            return;
#pragma unroll
        for (uint32_t slot = 0; slot < kSlots; ++slot) {
            const uint32_t row = slot / kItemsPerLane, k = t + 4 * (slot % kItemsPerLane);
            at[slot] = range.place<Waiting<kPair>::kRoom>(range.count + at[slot]);
            if ((keep >> slot & 1u) != 0) {
                waiting.index[at[slot]] = rows.anchors[row] * K + k;
                waiting.at(0, kOutputs, at[slot]) = of_eye[0][slot];
                waiting.at(1, kOutputs, at[slot]) = of_eye[1][slot];
            }
        }
        range.count += alive;
    }
    shapeLayers(networks, lane, hidden, [&](uint32_t r, uint32_t item, uint32_t which, float output) {
        const uint32_t slot = kPair ? item : kItemsPerLane * r + item;
        if ((keep >> slot & 1u) != 0)
            waiting.at(r, which, at[slot]) = output;
    });
}

// Decodes and projects all visible anchors. One block runs on each multiprocessor, of as many warps as have shared
// memory. kCompact: the model is compact. kBank: the model has a feature bank, so that features depend on the eye.
// kShared, kThins: as in DecodeFrame. kPair: there are two eyes, and the networks look from each.
template <bool kCompact, bool kBank, bool kShared, bool kThins, bool kPair>
__global__ void __launch_bounds__(32 * kMostDecodeWarps) decodeKernel(const __grid_constant__ DecodeCudaArgs args)
{
    GSC_DYNAMIC_SHARED(memory);
    DecodeNetworks& networks = *reinterpret_cast<DecodeNetworks*>(memory);
    loadNetworks<kBank>(args, networks);

    constexpr uint32_t kLooks = kPair ? 2 : 1; // calls of decodeRows() for the anchors of a step
    const uint32_t lane = threadIdx.x & 31u, g = lane >> 2;
    const uint32_t warp = (blockIdx.x * blockDim.x + threadIdx.x) >> 5, warps = gridDim.x * blockDim.x >> 5;
    const uint32_t count = min(*args.visible_count, args.visible_capacity);
    Waiting<kPair>& waiting = reinterpret_cast<Waiting<kPair>*>(memory + sizeof(DecodeNetworks))[threadIdx.x >> 5];
    WaitingRange range;
    EyeTally left, right;
    uint32_t positive = 0; // a bit for each eye that sees an opacity above zero
    const auto entryAt = [&](uint32_t index) { return index < count ? args.visible[index] : 0u; };
    // emits until there is room for the Gaussians of the next call
    const uint32_t most_new = kRows / kLooks * args.model.params.n_offsets;
    const uint32_t too_many = min(32u, Waiting<kPair>::kRoom - most_new + 1);

    // The first step of a warp is fixed, later ones come from a queue, since anchors differ in the number of Gaussians
    // that are kept. A last step without anchors emits the Gaussians that still wait; so this long code is there once.
    uint32_t first = warp * kRows;
    // 0: no anchor; in lanes from 16 on, later those of the next step
    uint32_t entries = entryAt(first + (lane & 15u));
    while (true) {
        const bool some = first < count;
        const uint32_t taken = some && lane == 0 ? atomicAdd(&args.counters->pass.next_anchors, kRows) : 0u;
        uint32_t next = 0;
#pragma unroll 1
        for (uint32_t look = 0; look < kLooks; ++look) {
            if (some) {
                Rows rows{};
#pragma unroll
                for (uint32_t r = 0; r < 2; ++r) {
                    const uint32_t row = g + 8 * (kPair ? look : r);
                    const uint32_t entry = kPair && r == 1 ? 0u : __shfl_sync(~0u, entries, row);
                    rows.anchors[r] = kPair && r == 1 ? rows.anchors[0] : entry & ((1u << kAnchorBits) - 1u);
                    rows.seen_by[r] = kPair && r == 1 ? rows.seen_by[0] : entry >> kAnchorBits;
                    if (args.fraction != nullptr)
                        for (uint32_t i = 0; i < (kPair ? 1u : 2u); ++i)
                            rows.fractions[r][i] = args.fraction[2 * min(first + row, count - 1) + (kPair ? r : i)];
                }
                decodeRows<kCompact, kBank, kPair>(args, networks, rows, lane, waiting, range, positive);
                __syncwarp();
                // prefetches for the next step here, where the registers of the networks are free; the inputs of this
                // step's networks were prefetched before
                if (look == 0) {
                    next = warps * kRows + __shfl_sync(~0u, taken, 0);
                    if (lane >= 16)
                        entries = entryAt(next + lane - 16);
                }
                if (look + 1 == kLooks)
                    askForAnchors<kCompact>(args, __shfl_sync(~0u, entries, lane | 16u), lane);
            }
            emitWaiting<kCompact, kShared, kThins, kPair>(args, waiting, range, some ? too_many : 1u, lane, left,
                                                          right);
        }
        if (!some)
            break;
        first = next;
        entries = __shfl_sync(~0u, entries, lane | 16u);
    }
    finish<kShared>(args, 0, left, positive, lane);
    if (args.eye_count > 1)
        finish<kShared>(args, 1, right, positive, lane);
}

template <bool kCompact>
void launchDecode(const DecodeCudaArgs& args, uint32_t processors, size_t shared_bytes, CUstream_st* stream)
{
    const auto launch = [&](auto bank, auto shared_bins, auto thins, auto pair) {
        constexpr bool kPair = decltype(pair)::value;
        // a block can have 99 KiB of shared memory on compute capability 8.6, 8.9 and 12.0
        static_assert(sizeof(DecodeNetworks) + 8 * sizeof(Waiting<kPair>) <= 99 * 1024);
        const size_t rooms = (shared_bytes - std::min(shared_bytes, sizeof(DecodeNetworks))) / sizeof(Waiting<kPair>);
        const auto warps = uint32_t(std::min<size_t>(rooms, kMostDecodeWarps));
        launchCuda(
            decodeKernel<kCompact, decltype(bank)::value, decltype(shared_bins)::value, decltype(thins)::value, kPair>,
            processors, 32 * warps, sizeof(DecodeNetworks) + warps * sizeof(Waiting<kPair>), stream, args);
    };
    const auto either = [](bool value, auto then) { value ? then(std::true_type()) : then(std::false_type()); };
    either(args.bank != nullptr, [&](auto bank) {
        either(args.shared_bins, [&](auto shared_bins) {
            either(args.thins, [&](auto thins) {
                either(args.eye_count == 2 && !args.merged, [&](auto pair) { launch(bank, shared_bins, thins, pair); });
            });
        });
    });
}

} // namespace gsc
