// SPDX-License-Identifier: Apache-2.0
#include "kernels/select/select_cuda.h"

#include "kernels/common/launch.cuh"
#include "kernels/select/cut.cuh"
#include "kernels/select/listing.cuh"
#include "kernels/select/visible.cuh"

#include <algorithm>

namespace gsc {

namespace {

constexpr uint32_t kGroupThreads = 256;
constexpr uint32_t kThreads = kGroupSize;    // one thread per anchor of a group
constexpr uint32_t kBlocksPerProcessor = 16; // of kThreads threads: all that a multiprocessor holds

// Args: SelectCudaArgs, or the same with the cut cache.
template <typename Args>
__global__ void __launch_bounds__(kGroupThreads) groupKernel(const __grid_constant__ Args args)
{
    const uint32_t lane = threadIdx.x & 31u;
    uint32_t tested[kMaxEyes] = {}, saved[kMaxEyes] = {};
    // whole warps stay in the loop: they vote
    for (uint32_t first = blockIdx.x * kGroupThreads + (threadIdx.x & ~31u); first < args.group_count;
         first += gridDim.x * kGroupThreads) {
        const uint32_t i = first + lane;
        uint32_t eyes = 0, kept = 0, tries = 0, unknown = i < args.group_count ? (1u << args.eye_count) - 1u : 0u;
        if constexpr (kHasCut<Args>) {
#pragma unroll
            for (uint32_t e = 0; e < kMaxEyes; ++e) {
                if ((unknown >> e & 1u) == 0)
                    continue;
                const CutOutcome found = args.cut.tables.outcomes[e][i];
                const bool holds = cutHolds(args.cut.now, e, found, i);
                kept |= holds ? 1u << e : 0u;
                eyes |= holds && found.shows != 0 ? 1u << e : 0u;
                tries |= !holds && cutIsDue(args.cut.now, e, found) ? 1u << e : 0u;
            }
            unknown &= ~kept;
        }
        const uint32_t shown = eyes; // for sure
        if (unknown != 0) {
            const GroupRecord group = args.model.groups[i];
#pragma unroll
            for (uint32_t e = 0; e < kMaxEyes; ++e)
                if ((unknown >> e & 1u) != 0) {
                    if (groupMayShow(args, group, args.eyes[e])) {
                        eyes |= 1u << e;
                    } else if constexpr (kHasCut<Args>) {
                        keepHidden(args, args.cut, e, i, group);
                    }
                }
        }
        const bool known = eyes == shown;
        if (!known) {
            kept &= ~shown; // what one eye sees is tested with what the other one may see
            const uint32_t count = args.model.groups[i].anchor_count;
#pragma unroll
            for (uint32_t e = 0; e < kMaxEyes; ++e)
                tested[e] += (eyes >> e & 1u) * count;
        }
        const uint32_t slot = listPlace(!known, &args.counters->groups_visible);
        if (!known)
            args.visible_groups[slot] = i | (tries & eyes) << kTryShift | eyes << kAnchorBits;
        if constexpr (kHasCut<Args>) {
            const uint32_t back = listPlace(known && eyes != 0, &args.counters->groups_known);
            if (known && eyes != 0)
                args.visible_groups[args.group_count - 1 - back] = i | eyes << kAnchorBits;
#pragma unroll
            for (uint32_t e = 0; e < kMaxEyes; ++e)
                saved[e] += kept >> e & 1u;
        }
    }
#pragma unroll
    for (uint32_t e = 0; e < kMaxEyes; ++e) {
        const uint32_t sum = __reduce_add_sync(~0u, tested[e]);
        if (lane == 0 && sum != 0)
            atomicAdd(&args.counters->anchors_tested[e], sum);
        if constexpr (kHasCut<Args>) {
            const uint32_t groups = __reduce_add_sync(~0u, saved[e]);
            if (lane == 0 && groups != 0)
                atomicAdd(&args.counters->groups_kept[e], groups);
        }
    }
}

// Args: SelectCudaArgs, which lists anchors, or StripSelectArgs, which lists their strips; with the cut cache or without.
template <typename Args>
__global__ void __launch_bounds__(kThreads) anchorKernel(const __grid_constant__ Args args)
{
    constexpr bool kStrips = kListsStrips<Args>, kCut = kHasCut<Args>;
    __shared__ uint32_t warp_count[kThreads / 32];
    __shared__ CutShared cut_shared;
    __shared__ uint32_t base;
    const uint32_t lane = threadIdx.x & 31u, warp = threadIdx.x >> 5;
    const uint32_t count = args.counters->groups_visible;
    uint32_t seen[kMaxEyes] = {}, fresh = 0;
    for (uint32_t i = blockIdx.x; i < count; i += gridDim.x) {
        const uint32_t entry = args.visible_groups[i], index = entry & ((1u << kTryShift) - 1);
        [[maybe_unused]] const uint32_t tries = entry >> kTryShift & ((1u << kMaxEyes) - 1);
        const GroupRecord& group = args.model.groups[index];
        const uint32_t anchor = group.anchor_first + threadIdx.x;
        const bool there = threadIdx.x < group.anchor_count;
        uint32_t eyes = 0;
        float fraction[kMaxEyes] = {1.0f, 1.0f};
        float4 placement{};
        if (there) {
            placement = reinterpret_cast<const float4*>(args.model.placement)[anchor];
            const float shift = args.model.lod_shift[group.level_index];
            const int32_t level = args.model.levels[group.level_index].level;
            for (uint32_t e = 0; e < args.eye_count; ++e)
                if ((entry >> kAnchorBits & 1u << e) != 0 &&
                    anchorVisible(args, args.eyes[e], anchor, level, shift, placement, fraction[e]))
                    eyes |= 1u << e;
        }
        const uint32_t any = __ballot_sync(~0u, eyes != 0);
        const uint32_t left = __ballot_sync(~0u, (eyes & 1u) != 0), right = __ballot_sync(~0u, (eyes & 2u) != 0);
        const bool half = (any >> (lane & 16u) & 0xffffu) != 0; // something of this lane's strip
        const bool first_half = (any & 0xffffu) != 0;
        if (lane == 0) {
            warp_count[warp] = kStrips ? uint32_t(first_half) + uint32_t(any >> 16 != 0) : __popc(any);
            seen[0] += __popc(left);
            seen[1] += __popc(right);
        }
        // a group is compact: the first of a warp's anchors stands for all
#pragma unroll
        for (uint32_t e = 0; e < kMaxEyes; ++e) {
            const uint32_t mask = e == 0 ? left : right;
            if (mask != 0 && lane == uint32_t(__ffs(int(mask)) - 1))
                addDepth(args, e, placement, uint32_t(__popc(mask)));
        }
        if constexpr (kCut)
#pragma unroll
            for (uint32_t e = 0; e < kMaxEyes; ++e)
                if ((tries >> e & 1u) != 0)
                    findWarp(args, args.cut.now, e, group, there, placement, e == 0 ? left : right, cut_shared);
        __syncthreads();
        if (threadIdx.x == 0) {
            uint32_t total = 0;
            for (uint32_t w = 0; w < kThreads / 32; ++w)
                total += warp_count[w];
            base = total != 0 ? atomicAdd(listLength(args), total) : 0;
        }
        __syncthreads();
        if constexpr (kCut)
            if (threadIdx.x < kMaxEyes && (tries >> threadIdx.x & 1u) != 0)
                keepFound(args.cut, threadIdx.x, index, group, cut_shared);
        uint32_t slot = base + (kStrips ? (lane < 16 ? 0u : uint32_t(first_half)) : __popc(any & ((1u << lane) - 1u)));
        for (uint32_t w = 0; w < warp; ++w)
            slot += warp_count[w];
        if constexpr (kStrips) {
            if (half && (lane & 15u) == 0) {
                const uint32_t strip = threadIdx.x / kStripAnchors;
                fresh += listStrip(args, slot,
                                   {index * kStripsPerGroup + strip, anchor,
                                    (left >> lane & 0xffffu) | (right >> lane) << 16,
                                    min(group.anchor_count - threadIdx.x, kStripAnchors)});
            }
            if (half && args.fraction != nullptr)
                for (uint32_t e = 0; e < kMaxEyes; ++e)
                    args.fraction[(size_t(slot) * kMaxEyes + e) * kStripAnchors + (lane & 15u)] = fraction[e];
        } else if (eyes != 0) {
            if (listAnchor(args, slot, anchor, eyes) && args.fraction != nullptr) {
                args.fraction[2 * slot] = fraction[0];
                args.fraction[2 * slot + 1] = fraction[1];
            }
        }
        __syncthreads(); // what is shared is used again
    }
    for (uint32_t e = 0; e < kMaxEyes; ++e)
        if (seen[e] != 0)
            atomicAdd(&args.counters->anchors_visible[e], seen[e]);
    if constexpr (kStrips)
        if (fresh != 0)
            atomicAdd(&args.tables.scratch->counters.fresh, fresh);
}

// The known groups: a thread for 32 anchors, a warp for 8 groups. Lists what anchorKernel() would.
template <typename Args>
__global__ void __launch_bounds__(kGroupThreads) knownKernel(const __grid_constant__ Args args)
{
    constexpr bool kStrips = kListsStrips<Args>;
    constexpr uint32_t kWords = kGroupSize / 32;
    const uint32_t lane = threadIdx.x & 31u, below = (1u << lane) - 1u;
    const uint32_t count = args.counters->groups_known * kWords;
    uint32_t seen[kMaxEyes] = {}, fresh = 0;
    // whole warps stay in the loop: they work together
    for (uint32_t first = blockIdx.x * kGroupThreads + (threadIdx.x & ~31u); first < count;
         first += gridDim.x * kGroupThreads) {
        const uint32_t i = first + lane, word = i % kWords;
        uint32_t words[kMaxEyes] = {}, index = 0, anchor = 0, room = 0;
        if (i < count) {
            const uint32_t entry = args.visible_groups[args.group_count - 1 - i / kWords];
            index = entry & ((1u << kTryShift) - 1);
            anchor = args.model.groups[index].anchor_first + 32 * word;
            room = args.model.groups[index].anchor_count;
#pragma unroll
            for (uint32_t e = 0; e < kMaxEyes; ++e)
                if ((entry >> kAnchorBits >> e & 1u) != 0)
                    words[e] = args.cut.tables.lanes[e][index].visible[word];
        }
#pragma unroll
        for (uint32_t e = 0; e < kMaxEyes; ++e) {
            if (words[e] == 0)
                continue;
            seen[e] += __popc(words[e]);
            const uint32_t first_seen = anchor + uint32_t(__ffs(int(words[e])) - 1);
            addDepth(args, e, reinterpret_cast<const float4*>(args.model.placement)[first_seen],
                     uint32_t(__popc(words[e])));
        }
        const uint32_t any = words[0] | words[1];
        const uint32_t wanted =
            kStrips ? uint32_t((any & 0xffffu) != 0) + uint32_t(any >> 16 != 0) : uint32_t(__popc(any));
        uint32_t sum = wanted; // of this lane and those before
#pragma unroll
        for (uint32_t step = 1; step < 32; step *= 2) {
            const uint32_t before = __shfl_sync(~0u, sum, int(lane - step) & 31);
            sum += lane >= step ? before : 0u;
        }
        uint32_t base = 0;
        if (lane == 31 && sum != 0)
            base = atomicAdd(listLength(args), sum);
        uint32_t slot = __shfl_sync(~0u, base, 31) + sum - wanted;
        if constexpr (kStrips) {
#pragma unroll
            for (uint32_t half = 0; half < 2; ++half) {
                const uint32_t left = words[0] >> 16 * half & 0xffffu, right = words[1] >> 16 * half & 0xffffu;
                const uint32_t strip = 2 * word + half;
                if ((left | right) != 0)
                    fresh += listStrip(args, slot++,
                                       {index * kStripsPerGroup + strip, anchor + 16 * half, left | right << 16,
                                        min(room - 16 * strip, kStripAnchors)});
            }
        } else {
            for (uint32_t some = __ballot_sync(~0u, any != 0); some != 0; some &= some - 1) {
                const int from = __ffs(int(some)) - 1;
                const uint32_t a = __shfl_sync(~0u, any, from), first_slot = __shfl_sync(~0u, slot, from);
                const uint32_t left = __shfl_sync(~0u, words[0], from), right = __shfl_sync(~0u, words[1], from);
                const uint32_t anchor_of = __shfl_sync(~0u, anchor, from) + lane;
                if ((a >> lane & 1u) != 0)
                    listAnchor(args, first_slot + __popc(a & below), anchor_of,
                               (left >> lane & 1u) | (right >> lane & 1u) << 1);
            }
        }
    }
#pragma unroll
    for (uint32_t e = 0; e < kMaxEyes; ++e) {
        const uint32_t all = __reduce_add_sync(~0u, seen[e]);
        if (lane == 0 && all != 0)
            atomicAdd(&args.counters->anchors_visible[e], all);
    }
    if constexpr (kStrips) {
        fresh = __reduce_add_sync(~0u, fresh);
        if (lane == 0 && fresh != 0)
            atomicAdd(&args.tables.scratch->counters.fresh, fresh);
    }
}

// Sized by capacity: the count is still on its way, and blocks without a group leave at once.
uint32_t anchorBlocks(const SelectCudaArgs& args, uint32_t processors)
{
    return std::max(std::min(args.group_count, processors * kBlocksPerProcessor), 1u);
}

uint32_t groupBlocks(const SelectCudaArgs& args, uint32_t processors)
{
    return std::max(std::min((args.group_count + kGroupThreads - 1) / kGroupThreads, 8 * processors), 1u);
}

template <typename Args>
void launchGroups(const Args& args, uint32_t processors, CUstream_st* stream)
{
    launchCuda(groupKernel<Args>, groupBlocks(args, processors), kGroupThreads, 0, stream, args);
}

template <typename Args>
void launchAnchors(const Args& args, uint32_t processors, CUstream_st* stream)
{
    launchCuda(anchorKernel<Args>, anchorBlocks(args, processors), kThreads, 0, stream, args);
}

} // namespace

void selectGroupsCuda(const SelectCudaArgs& args, uint32_t processors, CUstream_st* stream)
{
    launchGroups(args, processors, stream);
}

void selectAnchorsCuda(const SelectCudaArgs& args, uint32_t processors, CUstream_st* stream)
{
    launchAnchors(args, processors, stream);
}

void selectStripsCuda(const StripSelectArgs& args, uint32_t processors, CUstream_st* stream)
{
    launchAnchors(args, processors, stream);
}

void selectGroupsCuda(const WithCut<SelectCudaArgs>& args, uint32_t processors, CUstream_st* stream)
{
    launchGroups(args, processors, stream);
}

void selectAnchorsCuda(const WithCut<SelectCudaArgs>& args, uint32_t processors, CUstream_st* stream)
{
    launchAnchors(args, processors, stream);
}

void selectStripsCuda(const WithCut<StripSelectArgs>& args, uint32_t processors, CUstream_st* stream)
{
    launchAnchors(args, processors, stream);
}

void selectKnownCuda(const WithCut<SelectCudaArgs>& args, uint32_t processors, CUstream_st* stream)
{
    launchCuda(knownKernel<WithCut<SelectCudaArgs>>, groupBlocks(args, processors), kGroupThreads, 0, stream, args);
}

void selectKnownCuda(const WithCut<StripSelectArgs>& args, uint32_t processors, CUstream_st* stream)
{
    launchCuda(knownKernel<WithCut<StripSelectArgs>>, groupBlocks(args, processors), kGroupThreads, 0, stream, args);
}

} // namespace gsc
