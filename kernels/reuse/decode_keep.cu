// SPDX-License-Identifier: Apache-2.0
// Decodes whole strips into entries of the cache. A strip that gets no cache slot is drawn as it is decoded.
#include "kernels/cuda/launch.cuh"
#include "kernels/decode/fast/networks.cuh"
#include "kernels/reuse/kept_entry.cuh"

#include <type_traits>

namespace gsc {

namespace {

constexpr uint32_t kThreads = 256, kWarps = kThreads / 32;
constexpr uint32_t kBlocks = 2; // blocks that run on a multiprocessor at once

// Shared memory of a block: the networks, and the strips that its warps stage.
struct KeepShared {
    DecodeNetworks networks;
    StagedStrip staging[kWarps];
};
static_assert(sizeof(KeepShared) <= 99 * 1024); // a block can have no more on compute capability 8.6, 8.9 and 12.0

// kCompact: the model is compact. kBank: the model has a feature bank, so that features depend on the viewpoint.
// kShared, kThins: as in DecodeFrame.
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
    const uint32_t count = tables.counters->wants;
    StagedStrip& staged = shared.staging[threadIdx.x >> 5];
    EyeTally left, right;
    uint32_t positive = 0; // a bit for each eye that sees an opacity above zero

    for (uint32_t i = warp; i < count; i += warps) {
        const Want& want = tables.wants[i];
        const uint32_t id = tables.idOf(want.strip.strip, want.eye), slot = tables.slotOf(id);
        const uint32_t before = tables.entries[slot].owner;
        const bool kept = before == id || tables.claims[slot] == ~id;
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
        uint32_t feature[2][4]; // features of two rows, for each k tile
        float levels[2];
        gatherInputs<kCompact>(args, anchors, t, feature, levels);
        if (lane == 0)
            staged.first = want.strip.first;

        uint32_t hidden[6][4];
        const float* const center = args.merged ? args.look_from : args.eyes[want.eye].center;
        firstLayer<kBank>(args, shared.networks, lane, positions, {center, center}, feature, levels, hidden);
        float opacity[kOpacityTiles][4];
        opacityLayer(shared.networks, lane, hidden, opacity);
        uint32_t positive_rows = 0, keep = 0, at[2 * kItemsPerLane];
#pragma unroll
        for (uint32_t r = 0; r < 2; ++r)
#pragma unroll
            for (uint32_t item = 0; item < kItemsPerLane; ++item) {
                if (!exists[r] || t + 4 * item >= K)
                    continue;
                const float o = value(opacity, item, r);
                positive_rows |= o > 0.0f ? 1u << (g + 8 * r) : 0u;
                keep |= o >= kOpacityFloor ? 1u << (kItemsPerLane * r + item) : 0u;
            }
        positive_rows = __reduce_or_sync(~0u, positive_rows);
        const uint32_t alive = stagingIndices(keep, lane, at);
        if (kept && lane == 0) {
            tables.entries[slot] = {args.frame, args.frame, id, uint16_t(alive), uint16_t(positive_rows)};
            if (before != id && before != kNoEntry)
                atomicAdd(&tables.counters->evictions, 1u);
        }
        for (uint32_t e = 0; !kept && e < kMaxEyes; ++e)
            if ((want.eyes >> e & 1u) != 0 && (positive_rows & lanesOfEye(want.strip.lanes, e)) != 0)
                positive |= 1u << e;
        if (alive == 0)
            continue;
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
        if (kept)
            keepGaussians(tables, slot, staged, alive, lane);
        const bool both = want.eyes == 3u;
#pragma unroll 1
        for (uint32_t e = 0; !kept && e < kMaxEyes; ++e) {
            if ((want.eyes >> e & 1u) == 0)
                continue;
            float factors[2];
            keptFactors(args.fraction, want.index, e, lane, factors);
            EyeTally tally = e == 0 ? left : right;
            if (kShared) // with shared bins both eyes take splat slots from the writer of the first eye
                tally.writer = left.writer;
            emitStaged<kCompact, kShared, kThins>(args, e, staged, alive, {!both || e == 0, !both || e == 1}, seen_by,
                                                  factors, lane, tally);
            if (kShared)
                left.writer = tally.writer;
            if (e == 0)
                left = tally;
            else
                right = tally;
        }
        __syncwarp();
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
