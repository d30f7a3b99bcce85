// SPDX-License-Identifier: Apache-2.0
// The decoder of the tier `fast`, compiled for either layout of a model (decode.cu, decode_compact.cu).
#pragma once

#include "kernels/cuda/launch.cuh"
#include "kernels/decode/decode_steps.cuh"

#include <type_traits>

namespace gsc {

// The slots of what the first eye has written of this lane's Gaussians: kNoSlot but for the bits of the result, which are
// among `kept`, those it had staged. All lanes of the warp call it together.
__device__ __forceinline__ uint32_t slotsOfLeft(const Staging& staged, uint32_t kept, uint32_t lane,
                                                uint32_t (&slots)[2 * kItemsPerLane])
{
    uint32_t at[2 * kItemsPerLane], written = 0;
    stagingIndices(kept, lane, at);
#pragma unroll
    for (uint32_t slot = 0; slot < 2 * kItemsPerLane; ++slot) {
        slots[slot] = (kept >> slot & 1u) != 0 ? staged.slots[at[slot]] : kNoSlot;
        written |= slots[slot] != kNoSlot ? 1u << slot : 0u;
    }
    __syncwarp(); // they are written anew
    return written;
}

// Asks for what decoding reads of 16 anchors: lane i and i + 16 for that of entry i. They are not waited for until the next
// step, by which they have come from memory.
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

// kCompact: the model is compact. kBank: it has a feature bank, which makes the features depend on the eye. kShared,
// kThins: DecodeFrame.
template <bool kCompact, bool kBank, bool kShared, bool kThins>
__global__ void __launch_bounds__(kDecodeThreads, kDecodeBlocks)
    decodeKernel(const __grid_constant__ DecodeCudaArgs args)
{
    GSC_DYNAMIC_SHARED(memory);
    DecodeShared& shared = *reinterpret_cast<DecodeShared*>(memory);
    loadNetworks<kBank>(args, shared.networks);

    const DeviceModel& model = args.model;
    const uint32_t K = model.params.n_offsets;
    const uint32_t lane = threadIdx.x & 31u, t = lane & 3u, g = lane >> 2;
    const uint32_t warp = (blockIdx.x * kDecodeThreads + threadIdx.x) >> 5, warps = gridDim.x * kDecodeWarps;
    const uint32_t count = min(*args.visible_count, args.visible_capacity);
    Staging& staged = shared.staging[threadIdx.x >> 5];
    EyeTally left, right;
    uint32_t positive = 0; // bit per eye
    const auto entryAt = [&](uint32_t index) { return index < count ? args.visible[index] : 0u; };

    // The first step is fixed; the others come from a queue, for their Gaussians differ in number.
    uint32_t first = warp * kRows;
    while (first < count) {
        const uint32_t entries = entryAt(first + (lane & 15u)); // 0: no anchor
        const uint32_t taken = lane == 0 ? atomicAdd(&args.counters->pass.next_anchors, kRows) : 0u;
        uint32_t anchors[2], seen_by[2];
        float positions[2][3];
        uint32_t feature[2][4]; // per k tile
#pragma unroll
        for (uint32_t r = 0; r < 2; ++r) {
            const uint32_t entry = __shfl_sync(~0u, entries, g + 8 * r);
            anchors[r] = entry & ((1u << kAnchorBits) - 1u);
            seen_by[r] = entry >> kAnchorBits; // 0: no anchor
            const float4 p = reinterpret_cast<const float4*>(model.placement)[anchors[r]];
            positions[r][0] = p.x;
            positions[r][1] = p.y;
            positions[r][2] = p.z;
        }
        const uint32_t seen = __reduce_or_sync(~0u, seen_by[0] | seen_by[1]);
        float levels[2];
        gatherInputs<kCompact>(args, anchors, t, feature, levels);
        stageAnchors(anchors, lane, staged);
        const uint32_t next = warps * kRows + __shfl_sync(~0u, taken, 0);
        const uint32_t first_eye = args.merged ? 0u : 1u - (seen & 1u);

        const uint32_t decodes = args.merged ? 1 : args.eye_count;
        uint32_t keep_left = 0; // in shared bins: what the first eye has staged, like `keep`
#pragma unroll 1
        for (uint32_t e = 0; e < decodes; ++e) {
            if (!args.merged && (seen >> e & 1u) == 0)
                continue;
            const float* const center = args.merged ? args.look_from : args.eyes[e].center;
            uint32_t hidden[6][4];
            firstLayer<kBank>(args, shared.networks, lane, positions, center, feature, levels, hidden);
            uint32_t keep = 0; // bit 3 r + item
            uint32_t at[2 * kItemsPerLane];
            uint32_t alive;
            {
                float opacity[kOpacityTiles][4];
                opacityLayer(shared.networks, lane, hidden, opacity);
#pragma unroll
                for (uint32_t r = 0; r < 2; ++r)
#pragma unroll
                    for (uint32_t item = 0; item < kItemsPerLane; ++item) {
                        float o = tanhFast(value(opacity, item, r));
                        if (args.fraction != nullptr && !args.merged)
                            o *= args.fraction[2 * min(first + g + 8 * r, count - 1) + e];
                        const uint32_t eyes = args.merged ? seen_by[r] : seen_by[r] & 1u << e;
                        const bool present = eyes != 0 && t + 4 * item < K;
                        if (present && o > 0.0f)
                            positive |= eyes;
                        if (present && o >= kOpacityFloor)
                            keep |= 1u << (kItemsPerLane * r + item);
                        opacity[item >> 1][(item & 1u) + 2 * r] = o;
                    }
                uint32_t slots[2 * kItemsPerLane] = {}, kept = keep;
                if constexpr (kShared) {
                    if (e == 0)
                        keep_left = keep;
                    else
                        keep |= slotsOfLeft(staged, keep_left, lane, slots);
                }
                alive = stagingIndices(keep, lane, at);
                if (alive == 0)
                    continue;
#pragma unroll
                for (uint32_t r = 0; r < 2; ++r)
#pragma unroll
                    for (uint32_t item = 0; item < kItemsPerLane; ++item)
                        if (keep >> (kItemsPerLane * r + item) & 1u) {
                            const uint32_t i = at[kItemsPerLane * r + item];
                            staged.opacity[i] =
                                kept >> (kItemsPerLane * r + item) & 1u ? value(opacity, item, r) : 0.0f;
                            staged.owner[i] = uint16_t((g + 8 * r) | (t + 4 * item) << 8);
                            if (kShared && e != 0)
                                staged.slots[i] = slots[kItemsPerLane * r + item];
                        }
            }
            stageShapes(shared.networks, lane, hidden, keep, at, staged);
            __syncwarp();
            if (e == first_eye) // of the next step; here, where the networks' registers are free
                askForAnchors<kCompact>(args, entryAt(next + (lane & 15u)), lane);
#pragma unroll 1
            for (uint32_t v = e; v < (args.merged ? args.eye_count : e + 1); ++v) {
                float factors[2] = {1.0f, 1.0f};
                if (args.merged && args.fraction != nullptr)
                    for (uint32_t r = 0; r < 2; ++r)
                        factors[r] = args.fraction[2 * min(first + g + 8 * r, count - 1) + v];
                const Turns turns = {v == 0 || (!args.merged && (seen & 1u) == 0),
                                     v == 1 || (!args.merged && (seen >> 1 & 1u) == 0)};
                emitForEye<kCompact, kShared, kThins>(args, v, staged, alive, turns, seen_by, factors, lane, left,
                                                      right);
            }
            __syncwarp();
        }
        first = next;
    }
    finish<kShared>(args, 0, left, positive, lane);
    if (args.eye_count > 1)
        finish<kShared>(args, 1, right, positive, lane);
}

template <bool kCompact>
void launchDecode(const DecodeCudaArgs& args, uint32_t processors, CUstream_st* stream)
{
    const auto kernel_of = [&args](auto thins) {
        constexpr bool kThins = decltype(thins)::value;
        return args.bank != nullptr ? (args.shared_bins ? decodeKernel<kCompact, true, true, kThins>
                                                        : decodeKernel<kCompact, true, false, kThins>)
                                    : (args.shared_bins ? decodeKernel<kCompact, false, true, kThins>
                                                        : decodeKernel<kCompact, false, false, kThins>);
    };
    const auto kernel = args.thins ? kernel_of(std::true_type()) : kernel_of(std::false_type());
    launchCuda(kernel, processors * kDecodeBlocks, kDecodeThreads, sizeof(DecodeShared), stream, args);
}

} // namespace gsc
