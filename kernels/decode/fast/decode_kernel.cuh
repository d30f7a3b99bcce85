// SPDX-License-Identifier: Apache-2.0
// The decoder of the tier `fast`, compiled for either layout of a model (decode_fast.cu, decode_compact.cu). Between their
// networks and their projection Gaussians wait in a ring of their warp's until there are enough for every lane: a third to a
// half of an anchor's are not alive.
#pragma once

#include "kernels/cuda/launch.cuh"
#include "kernels/decode/fast/emit.cuh"
#include "kernels/decode/fast/networks.cuh"

#include <algorithm>
#include <type_traits>

namespace gsc {

constexpr uint32_t kOutputs = 10; // outputs of the networks per Gaussian, without its opacity

// A warp's ring. kPair: a Gaussian has the networks' outputs for each eye; else one set of outputs, and an opacity for
// each eye.
template <bool kPair>
struct Waiting {
    static constexpr uint32_t kRoom = kPair ? 109 : 192;                          // 99 KiB for 8 warps: launchDecode()
    static constexpr uint32_t kNew = kRows * 4 * kItemsPerLane / (kPair ? 2 : 1); // most new Gaussians of one look
    static_assert(kNew <= kRoom);

    float outputs[kPair ? 2 * (kOutputs + 1) : kOutputs + 2][kRoom]; // before activations; of each set the opacity last
    uint32_t index[kRoom];                                           // anchor * n_offsets + k

    // Output `which` of entry i for an eye, as emitGaussian() takes it; `which` kOutputs: the opacity.
    __device__ __forceinline__ float& at(uint32_t eye, uint32_t which, uint32_t i)
    {
        return outputs[kPair ? eye * (kOutputs + 1) + which : which + (which == kOutputs ? eye : 0u)][i];
    }
};

// Entries of a ring that are taken.
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

// Emits a warp's Gaussians in rounds of 32 as long as at least `least` (1 to 32) wait. The eyes take turns at a round,
// so that values common to both are read once.
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

// Asks for the data that decoding reads of 16 anchors: lanes i and i + 16 for that of entry i. They are not waited for
// until the next step, by which they have come from memory.
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
        ask(model.offset, 8 * K, half * (8 * K - 1)); // up to 96 bytes; thirds of them are no longer than a sector
        ask(model.offset, 8 * K, (1 + half) * (8 * K - 1) / 3);
        ask(model.shape, 24, 23 * half);
    } else {
        ask(model.compact_offset, 4 * K, half * (4 * K - 1)); // up to 48 bytes
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

// A lane's two of 16 rows: anchor, eyes that see it, level fraction.
struct Rows {
    uint32_t anchors[2], seen_by[2]; // seen_by: 0: no anchor
    float fractions[2][2];           // per row and eye, or of the row's only eye
};

// Decodes 16 rows and leaves those that live with those that wait, for which there must be room. kPair: a lane's rows are
// one anchor seen from each eye; else two anchors, seen from one place. positive: gets a bit for each eye that sees an
// opacity above zero.
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
        uint32_t feature[2][4]; // per k tile
#pragma unroll
        for (uint32_t r = 0; r < 2; ++r) {
            const float4 p = reinterpret_cast<const float4*>(model.placement)[rows.anchors[r]];
            positions[r][0] = p.x;
            positions[r][1] = p.y;
            positions[r][2] = p.z;
        }
        gatherInputs<kCompact>(args, rows.anchors, t, feature, levels);
        // zeros opaque to the compiler, which would else copy the features for each product
        const uint32_t nothing[2] = {args.eye_count >> 2, args.eye_count >> 3};
#pragma unroll
        for (uint32_t i = 0; i < 8; ++i)
            feature[i / 4][i % 4] ^= nothing[i % 2];
        const float* const one = args.merged ? args.look_from : args.eyes[0].center;
        const float* const centers[2] = {kPair ? args.eyes[0].center : one, kPair ? args.eyes[1].center : one};
        firstLayer<kBank>(args, networks, lane, positions, centers, feature, levels, hidden);
    }
    constexpr uint32_t kSlots = kPair ? kItemsPerLane : 2 * kItemsPerLane; // Gaussians of a lane
    constexpr uint32_t kEyes = kPair ? 1 : 2;                              // most eyes that see a row
    uint32_t keep = 0, at[kSlots];                                         // a bit for each
    {
        float opacity[kOpacityTiles][4]; // zero where an anchor has no such Gaussian: its weights and bias are
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

// One block per multiprocessor, of as many warps as it has shared memory for. kCompact: the model is compact. kBank: it has
// a feature bank, which makes the features depend on the eye. kShared, kThins: DecodeFrame. kPair: two eyes, each of which
// looks for itself.
template <bool kCompact, bool kBank, bool kShared, bool kThins, bool kPair>
__global__ void __launch_bounds__(32 * kMostDecodeWarps) decodeKernel(const __grid_constant__ DecodeCudaArgs args)
{
    GSC_DYNAMIC_SHARED(memory);
    DecodeNetworks& networks = *reinterpret_cast<DecodeNetworks*>(memory);
    loadNetworks<kBank>(args, networks);

    constexpr uint32_t kLooks = kPair ? 2 : 1; // looks at the anchors of a step
    const uint32_t lane = threadIdx.x & 31u, g = lane >> 2;
    const uint32_t warp = (blockIdx.x * blockDim.x + threadIdx.x) >> 5, warps = gridDim.x * blockDim.x >> 5;
    const uint32_t count = min(*args.visible_count, args.visible_capacity);
    Waiting<kPair>& waiting = reinterpret_cast<Waiting<kPair>*>(memory + sizeof(DecodeNetworks))[threadIdx.x >> 5];
    WaitingRange range;
    EyeTally left, right;
    uint32_t positive = 0; // bit per eye
    const auto entryAt = [&](uint32_t index) { return index < count ? args.visible[index] : 0u; };
    // emits until the next look has room
    const uint32_t most_new = kRows / kLooks * args.model.params.n_offsets;
    const uint32_t too_many = min(32u, Waiting<kPair>::kRoom - most_new + 1);

    // The first step is fixed; the others come from a queue, for their Gaussians differ in number. A last step without
    // anchors emits the Gaussians that still wait: so this long code is there once.
    uint32_t first = warp * kRows;
    uint32_t entries = entryAt(first + (lane & 15u)); // 0: no anchor; from lane 16 on soon those of the next step
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
                // for the next step: here the networks' registers are free, and the networks' own inputs were asked for
                // earlier
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
        // on compute capability 8.6, 8.9 and 12.0 a block can have 99 KiB
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
