// SPDX-License-Identifier: Apache-2.0
#include "kernels/coarse/coarse_cuda.h"
#include "kernels/coarse/coarse_list.cuh"
#include "kernels/cuda/launch.cuh"

#include <algorithm>

namespace gsc {

namespace {

constexpr uint32_t kThreads = 256;
// Buckets of urgency: below kUnseen are groups that cannot be drawn from a copy, in an order that differs from frame to
// frame; behind them are due copies, the largest change first.
constexpr uint32_t kUnseen = 1024, kStale = 3072;
static_assert(kUnseen + kStale == kCoarseUrgencies);
constexpr uint32_t kNothing = kCoarseUrgencies; // in place of a bucket: no copy is wanted

__device__ __forceinline__ uint32_t mixed(uint32_t group, uint32_t frame)
{
    uint32_t value = group * 2654435769u + frame * 2246822519u;
    value = (value ^ value >> 15) * 739982445u;
    return value >> 22; // the highest 10 bits
}

__global__ void resetKernel(const CoarseTables tables)
{
    const uint32_t first = blockIdx.x * blockDim.x + threadIdx.x, step = gridDim.x * blockDim.x;
    for (uint32_t i = first; i < tables.group_count; i += step)
        tables.groups[i] = CoarseGroup{};
    for (uint32_t i = first; i < tables.page_count; i += step)
        tables.ring[i] = i;
    for (uint32_t i = first; i < sizeof(CoarseBuckets) / sizeof(uint32_t); i += step)
        reinterpret_cast<uint32_t*>(tables.buckets)[i] = 0;
    if (first == 0)
        *tables.free = {0, tables.page_count};
}

// Pages that are free before the frame, and pages that shall be free: those of two frames.
__device__ __forceinline__ uint32_t freePages(const CoarseTables& tables)
{
    return uint32_t(tables.free->given - tables.free->taken);
}

__device__ __forceinline__ uint32_t wantedPages(const CoarseScheduleArgs& args)
{
    return min(2 * args.now.budget * kMostPages, args.tables.page_count / 4);
}

struct Looked : CoarseLook {
    uint32_t group, eyes;
};

__device__ __forceinline__ Looked lookAt(const CoarseScheduleArgs& args, uint32_t i, CoarseGroup& kept)
{
    const uint32_t entry = args.visible_groups[i], index = entry & ((1u << kAnchorBits) - 1),
                   eyes = entry >> kAnchorBits;
    const GroupRecord& group = args.model.groups[index];
    kept = args.tables.groups[index];
    bool shows_all = true;
    for (uint32_t e = 0; e < args.eye_count; ++e)
        if ((eyes >> e & 1u) != 0 && !seesAll(args.now.eyes[e], args.rules.near_z, group))
            shows_all = false;
    return {coarseLook(args.now.view, group, kept, shows_all), index, eyes};
}

__device__ __forceinline__ uint32_t urgencyOf(const CoarseScheduleArgs& args, const Looked& looked)
{
    if (!looked.due)
        return kNothing;
    const uint32_t order = mixed(looked.group, args.now.frame);
    if (!looked.draws)
        return order;
    // the bucket falls linearly from the change at which the copy cannot be drawn any more to the bound. Groups of
    // equal change are spread over kOwn buckets in the frame's own order, because a bucket with more groups than may be
    // made is not made at all, and a new detail or bias gives all groups one change
    constexpr uint32_t kOwn = 256, kLinear = kStale - kOwn;
    return kUnseen + uint32_t(float(kLinear) * (kStaleMost - looked.change)) + order * kOwn / kUnseen;
}

// First element of a block, and the distance to its next ones, when all threads of a launch go through an array.
__device__ __forceinline__ uint32_t firstOfBlock()
{
    return blockIdx.x * blockDim.x;
}

__device__ __forceinline__ uint32_t stepOfGrid()
{
    return gridDim.x * blockDim.x;
}

__device__ __forceinline__ void lookAtAll(const CoarseScheduleArgs& args)
{
    const uint32_t count = args.frame->groups_visible, step = stepOfGrid();
    for (uint32_t i = firstOfBlock() + threadIdx.x; i < count; i += step) {
        CoarseGroup kept;
        const Looked looked = lookAt(args, i, kept);
        const uint32_t urgency = urgencyOf(args, looked);
        args.tables.urgency[i] = urgency;
        if (urgency != kNothing)
            atomicAdd(&args.tables.buckets->urgencies[urgency], 1u);
    }
    if (args.now.again != 0 || freePages(args.tables) >= wantedPages(args))
        return;
    // counts pages by age, since copies that were not drawn lately give up their pages first; copies of the frame
    // before have age 1
    for (uint32_t base = firstOfBlock(); base < args.tables.group_count; base += step) {
        const uint32_t g = base + threadIdx.x;
        const CoarseGroup kept = g < args.tables.group_count ? args.tables.groups[g] : CoarseGroup{};
        const uint32_t age = kept.count != 0 ? min(args.now.frame - kept.used, kCoarseAges - 1) : 0u;
        const uint32_t peers = __match_any_sync(~0u, age), pages = __reduce_add_sync(peers, pagesOf(kept));
        if (age > 1 && (threadIdx.x & 31u) == uint32_t(__ffs(int(peers)) - 1))
            atomicAdd(&args.tables.buckets->ages[age], pages);
    }
}

// Returns the largest `end` for which the buckets before it hold `most` or less together; clears the buckets. Called by
// one block of 1024 threads.
template <uint32_t kBuckets>
__device__ __forceinline__ uint32_t bucketsWithin(uint32_t* buckets, uint32_t most, bool reversed)
{
    constexpr uint32_t kEach = kBuckets / 1024;
    __shared__ uint32_t sums[32], found;
    const uint32_t lane = threadIdx.x & 31u, warp = threadIdx.x >> 5;
    uint32_t own[kEach], sum = 0;
#pragma unroll
    for (uint32_t k = 0; k < kEach; ++k) {
        const uint32_t at = threadIdx.x * kEach + k;
        uint32_t& bucket = buckets[reversed ? kBuckets - 1 - at : at];
        own[k] = bucket;
        sum += own[k];
        bucket = 0;
    }
    uint32_t end = sumUpTo(sum);
    if (lane == 31)
        sums[warp] = end;
    if (threadIdx.x == 0)
        found = kBuckets;
    __syncthreads();
    for (uint32_t w = 0; w < warp; ++w)
        end += sums[w];
    uint32_t at = end - sum;
#pragma unroll
    for (uint32_t k = 0; k < kEach; ++k) {
        at += own[k];
        if (at > most)
            atomicMin(&found, threadIdx.x * kEach + k);
    }
    __syncthreads();
    const uint32_t result = found;
    __syncthreads();
    return result;
}

// Grants copies to be made, and chooses the age from which copies are evicted. Called by one block of 1024 threads.
__device__ __forceinline__ void grant(const CoarseScheduleArgs& args)
{
    CoarseCounters& counters = args.frame->coarse;
    CoarseBuckets& buckets = *args.tables.buckets;
    const uint32_t free = freePages(args.tables);
    // the pages that the frame's copies may take must be free before it
    const uint32_t budget = args.now.again != 0 ? 0u : min(args.now.budget, free / kMostPages);
    const uint32_t granted = bucketsWithin<kCoarseUrgencies>(buckets.urgencies, budget, false);
    const uint32_t wanted = wantedPages(args);
    const uint32_t missing = wanted - min(wanted, free);
    // if no pages are missing, all ages are 0
    const uint32_t within = missing != 0 ? bucketsWithin<kCoarseAges>(buckets.ages, missing, true) : 0;
    if (threadIdx.x != 0)
        return;
    counters.granted_before = granted;
    // evicts one bucket more than fits within; but copies that the frame before drew stay
    counters.evicted_from =
        missing != 0 && args.now.again == 0 ? max(kCoarseAges - min(within + 1, kCoarseAges), 2u) : 0u;
}

// Evicts copies that were not drawn lately. note: a step before listing, which marks the copies that are drawn
__device__ __forceinline__ void evict(const CoarseScheduleArgs& args)
{
    const CoarseTables& tables = args.tables;
    const uint32_t from = args.frame->coarse.evicted_from, step = stepOfGrid();
    if (from == 0)
        return;
    for (uint32_t g = firstOfBlock() + threadIdx.x; g < tables.group_count; g += step) {
        const CoarseGroup& kept = tables.groups[g];
        if (kept.count != 0 && args.now.frame - kept.used >= from) {
            givePages(tables, g, pagesOf(kept));
            tables.groups[g] = CoarseGroup{};
        }
    }
}

__device__ __forceinline__ void listAll(const CoarseScheduleArgs& args)
{
    const CoarseTables& tables = args.tables;
    CoarseCounters& counters = args.frame->coarse;
    const uint32_t count = args.frame->groups_visible, lane = threadIdx.x & 31u, step = stepOfGrid();
    uint32_t near = 0, fresh = 0, stale = 0, made = 0, fresh_anchors = 0, stale_anchors = 0, made_anchors = 0;
    for (uint32_t base = firstOfBlock(); base < count; base += step) {
        const uint32_t i = base + threadIdx.x;
        bool is_wanted = false, is_drawn = false;
        Looked looked{};
        CoarseGroup kept{};
        if (i < count) {
            looked = lookAt(args, i, kept);
            is_wanted = tables.urgency[i] < counters.granted_before && tables.urgency[i] != kNothing;
            is_drawn = !is_wanted && looked.draws;
            if (!is_wanted && !is_drawn) {
                ++near;
                // the copy is far beyond its bound and must be made anew in any case
                if (kept.count != 0 && looked.change > kStaleMost && args.now.again == 0) {
                    givePages(tables, looked.group, pagesOf(kept));
                    tables.groups[looked.group] = CoarseGroup{};
                }
            }
            if (is_drawn) {
                tables.groups[looked.group].used = args.now.frame;
                addCoarseDepth(args.now, args.histogram, args.model, looked.group, looked.eyes, kept.count);
                const bool again = kept.made == args.now.frame, is_stale = looked.change > 1.0f;
                (again ? made : is_stale ? stale : fresh) += 1;
                (again ? made_anchors : is_stale ? stale_anchors : fresh_anchors) += kept.anchors;
            }
        }
        const uint32_t entry = looked.group | looked.eyes << kAnchorBits;
        const bool is_near = i < count && !is_wanted && !is_drawn;
        const uint32_t at_near = appendPlace(is_near, lane, &counters.near);
        if (is_near)
            tables.near[at_near] = entry;
        const uint32_t at_drawn = appendPlace(is_drawn, lane, &counters.drawn);
        if (is_drawn)
            tables.drawn[at_drawn] = entry;
        const uint32_t at_wanted = appendPlace(is_wanted, lane, &counters.wants);
        if (is_wanted)
            tables.wants[at_wanted] = entry;
    }
    addOfWarp(&counters.groups_near, near, lane);
    addOfWarp(&counters.groups_kept, fresh, lane);
    addOfWarp(&counters.groups_stale, stale, lane);
    addOfWarp(&counters.groups_made, made, lane);
    addOfWarp(&counters.anchors_kept, fresh_anchors, lane);
    addOfWarp(&counters.anchors_stale, stale_anchors, lane);
    addOfWarp(&counters.anchors_made, made_anchors, lane);
}

__global__ void __launch_bounds__(kThreads) scheduleKernel(const __grid_constant__ CoarseScheduleArgs args)
{
    lookAtAll(args);
}

__global__ void __launch_bounds__(1024) grantKernel(const __grid_constant__ CoarseScheduleArgs args)
{
    grant(args);
}

__global__ void __launch_bounds__(kThreads) evictKernel(const __grid_constant__ CoarseScheduleArgs args)
{
    evict(args);
}

__global__ void __launch_bounds__(kThreads) listKernel(const __grid_constant__ CoarseScheduleArgs args)
{
    listAll(args);
}

// Does all four steps, for few groups. One block of 1024 threads.
__global__ void __launch_bounds__(1024) decideKernel(const __grid_constant__ CoarseScheduleArgs args)
{
    lookAtAll(args);
    __syncthreads();
    grant(args);
    __syncthreads();
    evict(args);
    __syncthreads();
    listAll(args);
}

uint32_t blocksFor(uint32_t items, uint32_t processors)
{
    return std::max(std::min((items + kThreads - 1) / kThreads, 8 * processors), 1u);
}

} // namespace

void loadCoarseSchedule(bool few)
{
    loadKernel(resetKernel);
    if (few)
        return loadKernel(decideKernel);
    for (const auto kernel : {scheduleKernel, grantKernel, evictKernel, listKernel})
        loadKernel(kernel);
}

void resetCoarseCuda(const CoarseTables& tables, uint32_t processors, CUstream_st* stream)
{
    launchCuda(resetKernel, blocksFor(std::max(tables.group_count, tables.page_count), processors), kThreads, 0, stream,
               tables);
}

void coarseDecideCuda(const CoarseScheduleArgs& args, CUstream_st* stream)
{
    launchCuda(decideKernel, 1, 1024, 0, stream, args);
}

void coarseScheduleCuda(const CoarseScheduleArgs& args, uint32_t processors, CUstream_st* stream)
{
    launchCuda(scheduleKernel, blocksFor(args.tables.group_count, processors), kThreads, 0, stream, args);
}

void coarseGrantCuda(const CoarseScheduleArgs& args, CUstream_st* stream)
{
    launchCuda(grantKernel, 1, 1024, 0, stream, args);
}

void coarseEvictCuda(const CoarseScheduleArgs& args, uint32_t processors, CUstream_st* stream)
{
    launchCuda(evictKernel, blocksFor(args.tables.group_count, processors), kThreads, 0, stream, args);
}

void coarseListCuda(const CoarseScheduleArgs& args, uint32_t processors, CUstream_st* stream)
{
    launchCuda(listKernel, blocksFor(args.tables.group_count, processors), kThreads, 0, stream, args);
}

} // namespace gsc
