// SPDX-License-Identifier: Apache-2.0
// Decode into entries: a granted strip at a time, all of its anchors, from one place or two.
#include "kernels/cuda/launch.cuh"
#include "kernels/decode/fast/networks.cuh"
#include "kernels/reuse/kept_entry.cuh"

#include <type_traits>

namespace gsc {

namespace {

constexpr uint32_t kThreads = 256, kWarps = kThreads / 32;
constexpr uint32_t kBlocks = 2; // per multiprocessor

// A block's networks, and what its warps stage.
struct KeepShared {
    DecodeNetworks networks;
    StagedStrip staging[kWarps];
};
static_assert(sizeof(KeepShared) <= 99 * 1024); // what a block can have on compute capability 8.6, 8.9 and 12.0

constexpr uint32_t kItems = 2 * kItemsPerLane; // of a lane: 3 r + item

// A strip is looked at as often as it takes: to know which Gaussians live at either key or on along the line, all of
// which are kept of both, the opacities at the second key come first. Without an entry the eyes that draw the strip
// stand for its keys: nothing says that one of them may draw what the other sees.
enum Look : uint32_t { kSecondOpacities = 0, kFirstKey = 1, kSecondKey = 2 }; // the last two: the bit of a key

// kCompact: the model is compact. kBank: it has a feature bank, which makes the features depend on the place. kShared,
// kThins: DecodeFrame.
template <bool kCompact, bool kBank, bool kShared, bool kThins>
__global__ void __launch_bounds__(kThreads, kBlocks) keepKernel(const __grid_constant__ KeepCudaArgs args)
{
    GSC_DYNAMIC_SHARED(memory);
    KeepShared& shared = *reinterpret_cast<KeepShared*>(memory);
    loadNetworks<kBank>(args, shared.networks);

    const ReuseTables& tables = args.tables;
    const uint32_t K = args.model.params.n_offsets;
    const uint32_t lane = threadIdx.x & 31u, t = lane & 3u, g = lane >> 2;
    const uint32_t warp = (blockIdx.x * kThreads + threadIdx.x) >> 5, warps = gridDim.x * kWarps;
    const uint32_t count = tables.scratch->counters.decodes;
    StagedStrip& staged = shared.staging[threadIdx.x >> 5];
    EyeTally left, right;
    uint32_t positive = 0; // bit per eye

    for (uint32_t i = warp; i < count; i += warps) {
        const Want& want = tables.wants[tables.decodes[i]];
        const uint32_t slot = want.slot;
        uint32_t anchors[2], seen_by[2];
        float positions[2][3];
        bool exists[2];
#pragma unroll
        for (uint32_t r = 0; r < 2; ++r) {
            const uint32_t row = g + 8 * r;
            exists[r] = row < want.strip.count;
            anchors[r] = want.strip.first + min(row, want.strip.count - 1);
            seen_by[r] = eyesOfRow(want.strip.lanes, row) & want.eyes;
            const float4 p = reinterpret_cast<const float4*>(args.model.placement)[anchors[r]];
            positions[r][0] = p.x;
            positions[r][1] = p.y;
            positions[r][2] = p.z;
        }
        uint32_t feature[2][4]; // per k tile
        float levels[2];
        gatherInputs<kCompact>(args, anchors, t, feature, levels);
        if (lane == 0)
            staged.first = want.strip.first;

        const bool kept = slot != kNoEntry;
        const uint32_t keys = kept ? (1u << want.keys.count) - 1u : want.eyes;
        const bool both = keys == 3u;
        float ahead[kItems] = {}; // opacities at the second key
        uint32_t keep = 0, at[kItems], alive = 0;
#pragma unroll 1
        for (uint32_t look = both ? kSecondOpacities : keys; look <= (both ? kSecondKey : keys); ++look) {
            const uint32_t key = look == kFirstKey ? 0 : 1;
            uint32_t hidden[6][4];
            const float* const center = kept            ? want.keys.center[key]
                                        : args.one_view ? args.look_from
                                                        : args.eyes[key].center;
            firstLayer<kBank>(args, shared.networks, lane, positions, {center, center}, feature, levels, hidden);
            float opacity[kOpacityTiles][4];
            opacityLayer(shared.networks, lane, hidden, opacity);
            uint32_t positive_rows = 0;
#pragma unroll
            for (uint32_t r = 0; r < 2; ++r)
#pragma unroll
                for (uint32_t item = 0; item < kItemsPerLane; ++item) {
                    if (exists[r] && t + 4 * item < K && value(opacity, item, r) > 0.0f)
                        positive_rows |= 1u << (g + 8 * r);
                }
            positive_rows = __reduce_or_sync(~0u, positive_rows);
            if (!kept && (positive_rows & want.strip.lanes >> (16 * key)) != 0)
                positive |= 1u << key;
            if (kept && lane == 0) // whether or not anything shows of it
                tables.entries[slot].positive[key] = uint16_t(positive_rows);
            if (look == kSecondOpacities) {
#pragma unroll
                for (uint32_t r = 0; r < 2; ++r)
#pragma unroll
                    for (uint32_t item = 0; item < kItemsPerLane; ++item)
                        ahead[kItemsPerLane * r + item] = value(opacity, item, r);
                continue;
            }
            if (look == kFirstKey || !both) {
                keep = 0;
#pragma unroll
                for (uint32_t r = 0; r < 2; ++r)
#pragma unroll
                    for (uint32_t item = 0; item < kItemsPerLane; ++item) {
                        const float o = value(opacity, item, r);
                        float most = o;
                        if (both) {
                            const float second = ahead[kItemsPerLane * r + item];
                            most = kept ? fmaxf(fmaf(kLeastMix, second - o, o), fmaf(kMostMix, second - o, o))
                                        : fmaxf(o, second);
                        }
                        if (exists[r] && t + 4 * item < K && most >= kOpacityFloor)
                            keep |= 1u << (kItemsPerLane * r + item);
                    }
                alive = stagingIndices(keep, lane, at);
            }
            if (kept && lane == 0)
                tables.entries[slot].alive = uint16_t(alive);
            if (alive == 0)
                break;
#pragma unroll
            for (uint32_t r = 0; r < 2; ++r)
#pragma unroll
                for (uint32_t item = 0; item < kItemsPerLane; ++item)
                    if (keep >> (kItemsPerLane * r + item) & 1u) {
                        const uint32_t to = at[kItemsPerLane * r + item];
                        staged.opacities[to] = value(opacity, item, r);
                        staged.owners[to] = uint16_t((g + 8 * r) | (t + 4 * item) << 8);
                    }
            shapeLayers(shared.networks, lane, hidden, [&](uint32_t r, uint32_t item, uint32_t which, float output) {
                if (keep >> (kItemsPerLane * r + item) & 1u)
                    staged.outputs[which][at[kItemsPerLane * r + item]] = output;
            });
            __syncwarp();
            if (kept) {
                keepGaussians(tables, slot, key, staged, alive, lane);
            } else {
                float factors[2];
                keptFactors(args.fraction, want.index, key, lane, factors);
                const Turns turns = {!both || key == 0, !both || key == 1};
                EyeTally tally = key == 0 ? left : right;
                if (kShared) // eyes that share their bins take the slots of both from the first one's
                    tally.writer = left.writer;
                emitStaged<kCompact, kShared, kThins>(args, key, staged, alive, turns, seen_by, factors, lane, tally);
                if (kShared)
                    left.writer = tally.writer;
                if (key == 0)
                    left = tally;
                else
                    right = tally;
            }
            __syncwarp();
        }
    }
    finish<kShared>(args, 0, left, positive, lane);
    if (args.eye_count > 1)
        finish<kShared>(args, 1, right, positive, lane);
}

} // namespace

void decodeKeepCuda(const KeepCudaArgs& args, uint32_t processors, CUstream_st* stream)
{
    const auto of_bank = [&args](auto compact, auto thins) {
        constexpr bool kCompact = decltype(compact)::value, kThins = decltype(thins)::value;
        return args.bank != nullptr ? (args.shared_bins ? keepKernel<kCompact, true, true, kThins>
                                                        : keepKernel<kCompact, true, false, kThins>)
                                    : (args.shared_bins ? keepKernel<kCompact, false, true, kThins>
                                                        : keepKernel<kCompact, false, false, kThins>);
    };
    const auto of_layout = [&](auto compact) {
        return args.thins ? of_bank(compact, std::true_type()) : of_bank(compact, std::false_type());
    };
    const auto kernel =
        args.model.compact_shape != nullptr ? of_layout(std::true_type()) : of_layout(std::false_type());
    launchCuda(kernel, processors * kBlocks, kThreads, sizeof(KeepShared), stream, args);
}

} // namespace gsc
