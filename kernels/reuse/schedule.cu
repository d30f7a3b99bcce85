// SPDX-License-Identifier: Apache-2.0
// Decides which listed strips are drawn from their entries and which are decoded again, by the rule of depth.h; each
// lane takes a strip.
#include "kernels/cuda/launch.cuh"
#include "kernels/cuda/warp_list.cuh"
#include "kernels/reuse/reuse_cuda.h"

namespace gsc {

namespace {

constexpr uint32_t kThreads = 256;
constexpr uint32_t kBlocksPerProcessor = 4;

struct Tally {
    uint32_t decoded[kMaxEyes] = {}, reused[kMaxEyes] = {}; // counts of this lane, in anchors
};

// Appends `want` to the list, unless no eye draws it. All lanes of the warp call it together.
__device__ void addWant(const ReuseTables& tables, const Want& want)
{
    const uint32_t at = appendPlace(want.eyes != 0, threadIdx.x & 31u, &tables.counters->wants);
    if (want.eyes != 0)
        tables.wants[at] = want;
}

// Decides for the eyes (a bit each) that draw from the entry `id`. Returns those for which the strip must be decoded.
__device__ uint32_t decide(const ScheduleCudaArgs& args, const ListedStrip& listed, uint32_t id, uint32_t eyes,
                           uint32_t depth, Tally& tally)
{
    if (eyes == 0)
        return 0;
    KeptEntry& entry = args.tables.entries[args.tables.slotOf(id)];
    const bool own = entry.owner == id, due = !own || !youngEnough(args.now.frame, entry.decoded, depth);
    if (own)
        entry.used = args.now.frame;
    bool decodes = due; // a decode for both eyes counts for the first eye that draws it
#pragma unroll
    for (uint32_t e = 0; e < kMaxEyes; ++e) {
        if ((eyes >> e & 1u) == 0)
            continue;
        tally.decoded[e] += decodes ? listed.count : 0u;
        tally.reused[e] += decodes ? 0u : __popc(lanesOfEye(listed.lanes, e));
        decodes = false;
    }
    return due ? eyes : 0;
}

__global__ void __launch_bounds__(kThreads, kBlocksPerProcessor)
    scheduleKernel(const __grid_constant__ ScheduleCudaArgs args)
{
    const ReuseNow& now = args.now;
    const ReuseTables& tables = args.tables;
    const ReuseCounters& counters = *tables.counters;
    const uint64_t visible = uint64_t(args.frame->anchors_visible[0]) + args.frame->anchors_visible[1];
    const uint32_t depth = reuseDepth(now.guidance, now.max_depth, updateRate(counters.fresh, visible));
    const uint32_t lane = threadIdx.x & 31u, strips = counters.strips;
    Tally tally;
    // all lanes of a warp stay in the loop, since they append together
    for (uint32_t base = blockIdx.x * kThreads + threadIdx.x - lane; base < strips; base += gridDim.x * kThreads) {
        const uint32_t i = base + lane;
        Want want{};
        uint32_t all = 0; // eyes that see the strip, a bit each
        if (i < strips) {
            want.strip = tables.listed[i];
            all = (lanesOfEye(want.strip.lanes, 0) != 0 ? 1u : 0u) | (lanesOfEye(want.strip.lanes, 1) != 0 ? 2u : 0u);
        }
        want.index = i;
        for (uint32_t owner = 0; owner < (now.merged != 0 ? 1 : kMaxEyes); ++owner) {
            want.eye = owner;
            want.eyes = decide(args, want.strip, tables.idOf(want.strip.strip, owner),
                               now.merged != 0 ? all : all & 1u << owner, depth, tally);
            addWant(tables, want);
        }
    }
    for (uint32_t e = 0; e < kMaxEyes; ++e) {
        addOfWarp(&tables.counters->decoded[e], tally.decoded[e], lane);
        addOfWarp(&tables.counters->reused[e], tally.reused[e], lane);
    }
}

// Lets strips that want a cache slot claim theirs, unless the entry in it was drawn in this frame; if several claim a
// slot, the first in the file gets it.
__global__ void __launch_bounds__(kThreads) claimKernel(const __grid_constant__ ScheduleCudaArgs args)
{
    const ReuseTables& tables = args.tables;
    for (uint32_t i = blockIdx.x * kThreads + threadIdx.x; i < tables.counters->wants; i += gridDim.x * kThreads) {
        const uint32_t id = tables.idOf(tables.wants[i].strip.strip, tables.wants[i].eye), slot = tables.slotOf(id);
        if (tables.entries[slot].used != args.now.frame)
            atomicMax(&tables.claims[slot], ~id);
    }
}

} // namespace

void scheduleCuda(const ScheduleCudaArgs& args, uint32_t processors, CUstream_st* stream)
{
    launchCuda(scheduleKernel, processors * kBlocksPerProcessor, kThreads, 0, stream, args);
}

void claimCuda(const ScheduleCudaArgs& args, uint32_t processors, CUstream_st* stream)
{
    launchCuda(claimKernel, processors * kBlocksPerProcessor, kThreads, 0, stream, args);
}

} // namespace gsc
