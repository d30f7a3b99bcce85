// SPDX-License-Identifier: Apache-2.0
// Tests the anchors of the visible groups as the trainers' code does, one thread for each anchor. `Lists` decides what
// is listed of them:
//   Args            arguments of the kernel, derived from SelectCudaArgs
//   entries(any)    entries of a warp whose visible anchors are `any`
//   length(args)    where the length of the list is counted
//   list(...)       writes what a thread has to write of its warp's entries; returns what finish() gets the sum of
//   finish(args, n) at the end, once per thread
#pragma once

#include "kernels/cuda/depth_cells.cuh"
#include "kernels/cuda/launch.cuh"
#include "kernels/select/select_cuda.h"
#include "kernels/select/visible.cuh"

#include <algorithm>

namespace gsc {

constexpr uint32_t kAnchorThreads = kGroupSize;
constexpr uint32_t kAnchorResident = 9; // blocks that a multiprocessor holds, which leaves 56 registers to a thread

// Anchor of a thread in its group, and lanes of the warp whose anchors are seen.
struct WarpOfGroup {
    const GroupRecord& group;
    uint32_t index;            // number of the group
    uint32_t anchor;           // number of this thread's anchor
    uint32_t eyes;             // eyes that see the anchor, a bit each
    uint32_t any, left, right; // lanes, a bit each, whose anchors are seen by any eye, by the first, the second
    uint32_t slot;             // index in the list of the warp's first entry
};

// Adds `count` visible anchors to the depth histogram, all at the depth of one of them.
__device__ __forceinline__ void addDepth(const SelectCudaArgs& args, uint32_t eye, const float4& placement,
                                         uint32_t count)
{
    const float z = viewPoint<float>(args.level_eyes[eye], {placement.x, placement.y, placement.z}).z;
    atomicAdd(args.histogram + depthBucket(__float_as_uint(fmaxf(z, 0.0f))), count);
}

template <typename Lists>
__global__ void __launch_bounds__(kAnchorThreads, kAnchorResident)
    anchorKernel(const __grid_constant__ typename Lists::Args args)
{
    __shared__ uint32_t warp_count[kAnchorThreads / 32];
    __shared__ uint32_t base;
    const uint32_t lane = threadIdx.x & 31u, warp = threadIdx.x >> 5;
    const uint32_t count = *args.group_count;
    uint32_t seen[kMaxEyes] = {}, noted = 0;
    for (uint32_t i = blockIdx.x; i < count; i += gridDim.x) {
        const uint32_t entry = args.listed_groups[i], index = entry & ((1u << kAnchorBits) - 1);
        const GroupRecord& group = args.model.groups[index];
        const uint32_t anchor = group.anchor_first + threadIdx.x;
        uint32_t eyes = 0;
        float fraction[kMaxEyes] = {1.0f, 1.0f};
        float4 placement{};
        if (threadIdx.x < group.anchor_count) {
            placement = reinterpret_cast<const float4*>(args.model.placement)[anchor];
            const float shift = args.model.lod_shift[group.level_index];
            const int32_t level = args.model.levels[group.level_index].level;
            for (uint32_t e = 0; e < args.eye_count; ++e)
                if ((entry >> kAnchorBits & 1u << e) != 0 &&
                    anchorVisible(args, args.level_eyes[e], anchor, level, shift, placement, fraction[e]) &&
                    anchorMayTouch(args.model, args.bands[e], anchor, placement))
                    eyes |= 1u << e;
        }
        const uint32_t any = __ballot_sync(~0u, eyes != 0);
        const uint32_t left = __ballot_sync(~0u, (eyes & 1u) != 0), right = __ballot_sync(~0u, (eyes & 2u) != 0);
        if (lane == 0) {
            warp_count[warp] = Lists::entries(any);
            seen[0] += __popc(left);
            seen[1] += __popc(right);
        }
        // a group is compact, so the first visible anchor of a warp gives the depth of all
#pragma unroll
        for (uint32_t e = 0; e < kMaxEyes; ++e) {
            const uint32_t mask = e == 0 ? left : right;
            if (mask != 0 && lane == uint32_t(__ffs(int(mask)) - 1))
                addDepth(args, e, placement, uint32_t(__popc(mask)));
        }
        __syncthreads();
        if (threadIdx.x == 0) {
            uint32_t total = 0;
            for (uint32_t w = 0; w < kAnchorThreads / 32; ++w)
                total += warp_count[w];
            base = total != 0 ? atomicAdd(Lists::length(args), total) : 0;
        }
        __syncthreads();
        uint32_t slot = base;
        for (uint32_t w = 0; w < warp; ++w)
            slot += warp_count[w];
        noted += Lists::list(args, WarpOfGroup{group, index, anchor, eyes, any, left, right, slot}, fraction);
        __syncthreads(); // waits before shared memory is written again
    }
    for (uint32_t e = 0; e < kMaxEyes; ++e)
        if (seen[e] != 0)
            atomicAdd(&args.counters->anchors_visible[e], seen[e]);
    Lists::finish(args, noted);
}

// Launches the test of all anchors of the visible groups. Asynchronous.
template <typename Lists>
void launchAnchors(const typename Lists::Args& args, uint32_t processors, CUstream_st* stream)
{
    // as many blocks as the groups of the model need, since the number of visible groups is not known on the host yet;
    // blocks without a group end at once
    const uint32_t blocks =
        std::max(std::min(uint32_t(args.model.params.group_count), processors * kAnchorResident), 1u);
    launchCuda(anchorKernel<Lists>, blocks, kAnchorThreads, 0, stream, args);
}

} // namespace gsc
