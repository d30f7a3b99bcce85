// SPDX-License-Identifier: Apache-2.0
// Which of what is to be decoded the budgets of decoding and of memory allow.
#include "kernels/cuda/launch.cuh"
#include "kernels/cuda/warp_list.cuh"
#include "kernels/reuse/reuse_cuda.h"

namespace gsc {

namespace {

constexpr uint32_t kThreads = 256;
constexpr uint32_t kBlocksPerProcessor = 4;
constexpr uint32_t kLevelThreads = 1024;

__global__ void __launch_bounds__(kThreads) resetKernel(const __grid_constant__ ReuseTables tables)
{
    const uint32_t first = blockIdx.x * kThreads + threadIdx.x, step = gridDim.x * kThreads;
    for (uint32_t i = first; i < tables.strips; i += step)
        for (uint32_t e = 0; e < kMaxEyes; ++e) {
            tables.slot_of[e][i] = kNoEntry;
            tables.seen[e][i] = {0, 0};
        }
    for (uint32_t i = first; i < tables.slots; i += step) {
        tables.entries[i].owner = kNoEntry;
        tables.free_list[i] = tables.slots - 1 - i;
    }
    if (first == 0)
        tables.scratch->state = {tables.slots, 0, {}, {}};
}

// Older before younger; those of one age in an order that has nothing to do with where they lie or in which slot.
__device__ uint32_t ageBucket(const KeptEntry& kept, uint32_t frame)
{
    const uint32_t age = min(frame - kept.used, 255u);
    return (255u - age) << 8 | (kept.owner * 2654435769u) >> 24;
}

__device__ bool mayGo(const KeptEntry& kept, uint32_t frame)
{
    return kept.owner != kNoEntry && kept.used != frame;
}

__global__ void __launch_bounds__(kThreads) ageKernel(const __grid_constant__ ScheduleCudaArgs args)
{
    const ReuseTables& tables = args.tables;
    if (tables.scratch->counters.wanted <= tables.scratch->state.free_slots)
        return;
    for (uint32_t i = blockIdx.x * kThreads + threadIdx.x; i < tables.slots; i += gridDim.x * kThreads)
        if (mayGo(tables.entries[i], args.now.frame))
            atomicAdd(&tables.scratch->ages[ageBucket(tables.entries[i], args.now.frame)], 1u);
}

struct Reach {
    uint32_t buckets, sum;
};

// The most of the first buckets whose sum is not above `limit`. All threads of the block call it; valid in thread 0.
__device__ Reach reachWithin(const uint32_t* histogram, uint32_t buckets, uint64_t limit)
{
    __shared__ uint32_t parts[kLevelThreads];
    __shared__ uint32_t sums[32];
    const uint32_t each = buckets / kLevelThreads;
    uint32_t sum = 0;
    for (uint32_t i = 0; i < each; ++i)
        sum += histogram[threadIdx.x * each + i];
    parts[threadIdx.x] = sum;
    __syncthreads();
    if (threadIdx.x < 32) {
        sum = 0;
        for (uint32_t i = 0; i < 32; ++i)
            sum += parts[threadIdx.x * 32 + i];
        sums[threadIdx.x] = sum;
    }
    __syncthreads();
    Reach reach{0, 0};
    if (threadIdx.x == 0) {
        uint64_t all = 0;
        uint32_t at = 0;
        const auto walk = [&](const uint32_t* counts, uint32_t end) {
            while (at < end && all + counts[at] <= limit)
                all += counts[at++];
        };
        walk(sums, 32);
        if (at < 32) {
            at *= 32;
            walk(parts, at + 32);
            at *= each;
            walk(histogram, at + each);
            reach.buckets = at;
        } else {
            reach.buckets = buckets;
        }
        reach.sum = uint32_t(all);
    }
    __syncthreads(); // parts and sums are reused
    return reach;
}

__global__ void __launch_bounds__(kLevelThreads) levelKernel(const __grid_constant__ ScheduleCudaArgs args)
{
    const ReuseTables& tables = args.tables;
    const ReuseNow& now = args.now;
    ReuseCounters& counters = tables.scratch->counters;
    ReuseState& state = tables.scratch->state;
    const uint32_t wanted = counters.wanted, free_slots = state.free_slots;
    if (now.again != 0)
        return;
    if (now.rule.decode_budget > 0) {
        for (uint32_t e = 0; e < now.eye_count; ++e) {
            const uint64_t spent = counters.decoded[e];
            const uint64_t left = spent < now.rule.decode_budget ? now.rule.decode_budget - spent : 0;
            const Reach reach = reachWithin(tables.scratch->urgencies[e], kUrgencies, left);
            if (threadIdx.x == 0) {
                counters.granted_before[e] = reach.buckets;
                counters.split_left[e] = reach.buckets < kUrgencies ? uint32_t(left - reach.sum) : 0u;
                const float rates = float(counters.rates[e]) * (1.0f / kRateUnit);
                state.level[now.frame & 1u][e] = budgetLevel(now.rule, counters.due[e], rates);
            }
        }
        if (threadIdx.x == 0)
            state.level_frame[now.frame & 1u] = now.frame;
    }
    uint32_t room = free_slots;
    if (wanted > free_slots) {
        const Reach old = reachWithin(tables.scratch->ages, kAges, wanted - free_slots - 1);
        if (threadIdx.x == 0) {
            counters.evicted_before = min(old.buckets + 1, kAges);
            room += old.sum + (old.buckets < kAges ? tables.scratch->ages[old.buckets] : 0u);
        }
    }
    const Reach kept = reachWithin(tables.scratch->orders, kOrders, room); // note: the room is thread 0's to know
    if (threadIdx.x == 0)
        counters.kept_before = kept.buckets;
}

__global__ void __launch_bounds__(kThreads) splitKernel(const __grid_constant__ ScheduleCudaArgs args)
{
    const ReuseTables& tables = args.tables;
    const ReuseCounters& counters = tables.scratch->counters;
    for (uint32_t i = blockIdx.x * kThreads + threadIdx.x; i < counters.wants; i += gridDim.x * kThreads) {
        const Want& want = tables.wants[i];
        if (want.bucket == counters.granted_before[want.eye])
            atomicAdd(&tables.scratch->splits[want.eye][splitOf(want.strip.strip, args.now.frame)],
                      want.strip.count * want.keys.count);
    }
}

__global__ void __launch_bounds__(kLevelThreads) splitLevelKernel(const __grid_constant__ ScheduleCudaArgs args)
{
    ReuseCounters& counters = args.tables.scratch->counters;
    for (uint32_t e = 0; e < args.now.eye_count; ++e) {
        const Reach reach = reachWithin(args.tables.scratch->splits[e], kSplits, counters.split_left[e]);
        if (threadIdx.x == 0)
            counters.split_before[e] = reach.buckets;
    }
}

// Does the budget reach as far as the want?
__device__ bool isGranted(const ScheduleCudaArgs& args, const Want& want)
{
    const ReuseCounters& counters = args.tables.scratch->counters;
    const uint32_t before = counters.granted_before[want.eye];
    return want.bucket == kMust || want.bucket < before ||
           (want.bucket == before && splitOf(want.strip.strip, args.now.frame) < counters.split_before[want.eye]);
}

__global__ void __launch_bounds__(kThreads) evictKernel(const __grid_constant__ ScheduleCudaArgs args)
{
    const ReuseTables& tables = args.tables;
    const uint32_t before = tables.scratch->counters.evicted_before;
    if (before == 0)
        return;
    for (uint32_t i = blockIdx.x * kThreads + threadIdx.x; i < tables.slots; i += gridDim.x * kThreads) {
        KeptEntry& kept = tables.entries[i];
        if (!mayGo(kept, args.now.frame) || ageBucket(kept, args.now.frame) >= before)
            continue;
        tables.slot_of[kept.owner & 1u][kept.owner >> 1] = kNoEntry;
        kept.owner = kNoEntry;
        tables.free_list[atomicAdd(&tables.scratch->state.free_slots, 1u)] = i;
        atomicAdd(&tables.scratch->state.evictions, 1u);
    }
}

// The slot a granted want decodes into, or kNoEntry.
__device__ uint32_t slotFor(const ScheduleCudaArgs& args, const Want& want)
{
    const ReuseTables& tables = args.tables;
    if (args.now.again != 0) // wanted because there was none
        return kNoEntry;
    uint32_t slot = tables.slot_of[want.eye][want.strip.strip];
    if (slot == kNoEntry) {
        if (!args.ample && uint64_t(want.strip.strip) * kOrders / tables.strips >= tables.scratch->counters.kept_before)
            return kNoEntry;
        slot = tables.free_list[atomicAdd(&tables.scratch->state.free_slots, ~0u) - 1];
        tables.slot_of[want.eye][want.strip.strip] = slot;
    }
    KeptEntry kept{};
    kept.keys = want.keys;
    kept.decoded = kept.used = args.now.frame;
    kept.owner = want.strip.strip * 2 + want.eye;
    tables.entries[slot] = kept;
    return slot;
}

__global__ void __launch_bounds__(kThreads) grantKernel(const __grid_constant__ ScheduleCudaArgs args)
{
    const ReuseTables& tables = args.tables;
    ReuseCounters& counters = tables.scratch->counters;
    const uint32_t lane = threadIdx.x & 31u, wants = counters.wants;
    uint32_t decoded[kMaxEyes] = {}, reused[kMaxEyes] = {}, overdue[kMaxEyes] = {};
    // whole warps stay in the loop: they vote
    for (uint32_t base = blockIdx.x * kThreads + (threadIdx.x & ~31u); base < wants; base += gridDim.x * kThreads) {
        const uint32_t i = base + lane;
        Want want{};
        bool granted = false;
        if (i < wants) {
            want = tables.wants[i];
            granted = isGranted(args, want);
            const uint32_t slot = granted ? slotFor(args, want) : kNoEntry;
            if (granted)
                tables.wants[i].slot = slot;
            // who counts it: merged entries are the first eye's, which need not see the strip
            const uint32_t counter = (want.eyes >> want.eye & 1u) != 0 ? want.eye : 1 - want.eye;
#pragma unroll
            for (uint32_t e = 0; e < kMaxEyes; ++e) {
                if ((want.eyes >> e & 1u) == 0)
                    continue;
                // what no slot holds is decoded once for each eye, and drawn as it is decoded
                const uint32_t decodes = !granted           ? 0u
                                         : slot == kNoEntry ? want.strip.count
                                         : e == counter     ? want.strip.count * want.keys.count
                                                            : 0u;
                const uint32_t counted = want.bucket == kMust && e == counter ? want.strip.count * want.keys.count : 0u;
                const uint32_t visible = __popc(want.strip.lanes >> (16 * e) & 0xffffu);
                tables.drawn[want.index].slot[e] = tables.decided[want.strip.strip].slot[e] =
                    granted ? slot : want.fallback[e];
                decoded[e] += decodes - counted;
                overdue[e] += granted ? 0u : visible;
                reused[e] += decodes == 0 ? visible : 0u;
            }
        }
        const uint32_t at = appendPlace(granted, lane, &counters.decodes);
        if (granted)
            tables.decodes[at] = i;
    }
#pragma unroll
    for (uint32_t e = 0; e < kMaxEyes; ++e) {
        addOfWarp(&counters.decoded[e], decoded[e], lane);
        addOfWarp(&counters.reused[e], reused[e], lane);
        addOfWarp(&counters.overdue[e], overdue[e], lane);
    }
}

} // namespace

void resetReuseCuda(const ReuseTables& tables, CUstream_st* stream)
{
    constexpr uint32_t kBlocks = 64; // rare
    launchCuda(resetKernel, kBlocks, kThreads, 0, stream, tables);
}

void countAgesCuda(const ScheduleCudaArgs& args, uint32_t processors, CUstream_st* stream)
{
    launchCuda(ageKernel, processors * kBlocksPerProcessor, kThreads, 0, stream, args);
}

void reuseLevelsCuda(const ScheduleCudaArgs& args, CUstream_st* stream)
{
    launchCuda(levelKernel, 1, kLevelThreads, 0, stream, args);
}

void countSplitsCuda(const ScheduleCudaArgs& args, uint32_t processors, CUstream_st* stream)
{
    launchCuda(splitKernel, processors * kBlocksPerProcessor, kThreads, 0, stream, args);
}

void splitLevelsCuda(const ScheduleCudaArgs& args, CUstream_st* stream)
{
    launchCuda(splitLevelKernel, 1, kLevelThreads, 0, stream, args);
}

void evictCuda(const ScheduleCudaArgs& args, uint32_t processors, CUstream_st* stream)
{
    launchCuda(evictKernel, processors * kBlocksPerProcessor, kThreads, 0, stream, args);
}

void grantCuda(const ScheduleCudaArgs& args, uint32_t processors, CUstream_st* stream)
{
    launchCuda(grantKernel, processors * kBlocksPerProcessor, kThreads, 0, stream, args);
}

} // namespace gsc
