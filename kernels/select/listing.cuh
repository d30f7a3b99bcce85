// SPDX-License-Identifier: Apache-2.0
// What the kernels of selection write: lists of visible anchors or of their strips, and a histogram of their depths.
#pragma once

#include "kernels/common/depth_cells.cuh"
#include "kernels/select/select_cuda.h"

#include <cuda_runtime.h>

#include <type_traits>

namespace gsc {

template <typename Args>
constexpr bool kListsStrips = std::is_base_of_v<StripSelectArgs, Args>;

// A place in a list for every lane that wants one; one atomic serves the warp, which calls it together.
__device__ __forceinline__ uint32_t listPlace(bool wants, uint32_t* length)
{
    const uint32_t lane = threadIdx.x & 31u, all = __ballot_sync(~0u, wants);
    uint32_t base = 0;
    if (lane == 0 && all != 0)
        base = atomicAdd(length, uint32_t(__popc(all)));
    return __shfl_sync(~0u, base, 0) + __popc(all & ((1u << lane) - 1u));
}

// How long the list of a frame is so far.
template <typename Args>
__device__ __forceinline__ uint32_t* listLength(const Args& args)
{
    if constexpr (kListsStrips<Args>)
        return &args.tables.scratch->counters.strips;
    else
        return &args.counters->anchors_listed;
}

// Counts visible anchors at the depth of one of them.
__device__ __forceinline__ void addDepth(const SelectCudaArgs& args, uint32_t eye, const float4& placement,
                                         uint32_t count)
{
    const float z = viewPoint<float>(args.eyes[eye], {placement.x, placement.y, placement.z}).z;
    atomicAdd(args.histogram + depthBucket(__float_as_uint(fmaxf(z, 0.0f))), count);
}

// Notes what is seen of a strip for the next frame. Returns the anchors the frame before did not see, of both eyes.
__device__ __forceinline__ uint32_t freshLanes(const StripSelectArgs& args, const ListedStrip& listed)
{
    const SeenStrip before = args.tables.seen[(args.frame - 1) & 1u][listed.strip];
    args.tables.seen[args.frame & 1u][listed.strip] = {listed.lanes, args.frame};
    return __popc(listed.lanes & ~(before.frame == args.frame - 1 ? before.lanes : 0u));
}

// Returns freshLanes(), if they are counted.
__device__ __forceinline__ uint32_t listStrip(const StripSelectArgs& args, uint32_t slot, const ListedStrip& listed)
{
    args.tables.listed[slot] = listed;
    return args.counts_fresh ? freshLanes(args, listed) : 0u;
}

// Lists an anchor, or says that there is no room for it.
__device__ __forceinline__ bool listAnchor(const SelectCudaArgs& args, uint32_t slot, uint32_t anchor, uint32_t eyes)
{
    if (slot < args.capacity)
        args.visible[slot] = anchor | eyes << kAnchorBits;
    else
        atomicOr(&args.counters->overflow, kVisibleOverflow);
    return slot < args.capacity;
}

} // namespace gsc
