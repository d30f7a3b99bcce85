// SPDX-License-Identifier: Apache-2.0
#include "kernels/select/select_cuda.h"

#include "kernels/cuda/warp_list.cuh"
#include "kernels/select/anchor_kernel.cuh"

#include <algorithm>

namespace gsc {

namespace {

constexpr uint32_t kGroupThreads = 256;
constexpr uint32_t kGroupBlocks = 4; // blocks that a multiprocessor holds, which leaves 64 registers to a thread
// runs that a warp tests at once: each lane tests the chunk of one run for one eye
constexpr uint32_t kRunsAtOnce = 32 / kMaxEyes;
constexpr uint32_t kAllEyes = (1u << kMaxEyes) - 1;

__global__ void __launch_bounds__(kGroupThreads, kGroupBlocks) groupKernel(const __grid_constant__ SelectCudaArgs args)
{
    const uint32_t lane = threadIdx.x & 31u;
    const uint32_t warps = gridDim.x * (kGroupThreads / 32);
    if (blockIdx.x == 0 && threadIdx.x == 0 && !args.columns.all()) {
        args.counters->columns = args.columns;
        for (uint32_t e = 0; e < kMaxEyes; ++e)
            // anchors of other columns are not tested, and some may have an opacity above zero
            args.counters->any_positive[e] = 1;
    }
    uint32_t groups[kMaxEyes] = {}, anchors[kMaxEyes] = {};
    // all lanes of a warp stay in the loop, since they vote. A warp takes every run whose distance from its first is a
    // multiple of `warps`, so that each warp has one even if runs are few
    for (uint32_t first = blockIdx.x * (kGroupThreads / 32) + (threadIdx.x >> 5); first < args.run_count;
         first += warps * kRunsAtOnce) {
        const uint32_t mine = first + lane / kMaxEyes * warps, eye = lane % kMaxEyes;
        uint32_t open = __ballot_sync(~0u, mine < args.run_count && eye < args.eye_count &&
                                               mayShow(args, args.model.runs[mine], eye));
        while (open != 0) {
            const uint32_t at = uint32_t(__ffs(int(open)) - 1) / kMaxEyes * kMaxEyes;
            const uint32_t candidates = open >> at & kAllEyes;
            open &= ~(kAllEyes << at);
            const GroupRun& run = args.model.runs[first + at / kMaxEyes * warps];
            const uint32_t i = run.group_first + lane;
            uint32_t eyes = 0, count = 0;
            if (lane < run.group_count) {
                const GroupRecord group = args.model.groups[i];
                count = group.anchor_count;
#pragma unroll
                for (uint32_t e = 0; e < kMaxEyes; ++e)
                    if ((candidates >> e & 1u) != 0 && mayShow(args, group, e))
                        eyes |= 1u << e;
            }
#pragma unroll
            for (uint32_t e = 0; e < kMaxEyes; ++e) {
                groups[e] += (candidates >> e & 1u) * run.group_count;
                anchors[e] += (eyes >> e & 1u) * count;
            }
            const uint32_t place = appendPlace(eyes != 0, lane, &args.counters->groups_visible);
            if (eyes != 0)
                args.visible_groups[place] = i | eyes << kAnchorBits;
        }
    }
#pragma unroll
    for (uint32_t e = 0; e < kMaxEyes; ++e) {
        if (lane == 0 && groups[e] != 0)
            atomicAdd(&args.counters->groups_tested[e], groups[e]);
        addOfWarp(&args.counters->anchors_tested[e], anchors[e], lane);
    }
}

// Lists visible anchors, for the kernel in anchor_kernel.cuh: one entry for each anchor.
struct ListAnchors {
    using Args = SelectCudaArgs;

    static __device__ __forceinline__ uint32_t entries(uint32_t any) { return uint32_t(__popc(any)); }

    static __device__ __forceinline__ uint32_t* length(const Args& args) { return &args.counters->anchors_listed; }

    static __device__ __forceinline__ uint32_t list(const Args& args, const WarpOfGroup& warp, const float* fraction)
    {
        if (warp.eyes == 0)
            return 0;
        const uint32_t slot = warp.slot + __popc(warp.any & ((1u << (threadIdx.x & 31u)) - 1u));
        if (slot >= args.capacity) {
            atomicOr(&args.counters->overflow, kVisibleOverflow);
            return 0;
        }
        args.visible[slot] = warp.anchor | warp.eyes << kAnchorBits;
        if (args.fraction != nullptr) {
            args.fraction[2 * slot] = fraction[0];
            args.fraction[2 * slot + 1] = fraction[1];
        }
        return 0;
    }

    static __device__ __forceinline__ void finish(const Args&, uint32_t) {}
};

} // namespace

void selectGroupsCuda(const SelectCudaArgs& args, uint32_t processors, CUstream_st* stream)
{
    constexpr uint32_t kRuns = kGroupThreads / 32; // runs of a block, one for each warp
    const uint32_t blocks = std::max(std::min((args.model.run_count + kRuns - 1) / kRuns, 8 * processors), 1u);
    launchCuda(groupKernel, blocks, kGroupThreads, 0, stream, args);
}

void selectAnchorsCuda(const SelectCudaArgs& args, uint32_t processors, CUstream_st* stream)
{
    launchAnchors<ListAnchors>(args, processors, stream);
}

} // namespace gsc
