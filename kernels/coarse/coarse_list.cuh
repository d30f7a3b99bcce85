// SPDX-License-Identifier: Apache-2.0
// Pages and depths of coarse copies, for the kernels that list copies.
#pragma once

#include "kernels/coarse/coarse_cuda.h"
#include "kernels/cuda/depth_cells.cuh"
#include "kernels/cuda/warp_list.cuh"

namespace gsc {

// Size of the ring. note: room for twice the pages, so that a place is not written before its old page has been read
__device__ __forceinline__ uint32_t ringRoom(const CoarseTables& tables)
{
    return 2 * tables.page_count;
}

// Place in the ring of the page `p` behind `from`; p is at most the size of the ring.
__device__ __forceinline__ uint32_t ringPlace(const CoarseTables& tables, unsigned long long from, uint32_t p)
{
    const uint32_t room = ringRoom(tables), at = uint32_t(from % room) + p;
    return at >= room ? at - room : at;
}

// Gives the pages of a copy to the ring. They become free after this frame: pages that it takes were free before it.
__device__ __forceinline__ void givePages(const CoarseTables& tables, uint32_t group, uint32_t pages)
{
    const unsigned long long at = atomicAdd(&tables.free->given, static_cast<unsigned long long>(pages));
    for (uint32_t p = 0; p < pages; ++p)
        tables.ring[ringPlace(tables, at, p)] = tables.page_of[size_t(group) * kMostPages + p];
}

// Adds a copy of `count` Gaussians to the depth histogram, in which select counts anchors: for each eye, as the number
// of anchors that gives as many Gaussians.
__device__ __forceinline__ void addCoarseDepth(const FrameNow& now, uint32_t* histogram, const DeviceModel& model,
                                               uint32_t group, uint32_t eyes, uint32_t gaussians)
{
    const GroupRecord& record = model.groups[group];
    const Vec3<float> middle{0.5f * (record.anchor_min[0] + record.anchor_max[0]),
                             0.5f * (record.anchor_min[1] + record.anchor_max[1]),
                             0.5f * (record.anchor_min[2] + record.anchor_max[2])};
    const uint32_t anchors = (gaussians + model.params.n_offsets / 2) / max(model.params.n_offsets, 1u);
    for (uint32_t e = 0; e < kMaxEyes; ++e)
        if ((eyes >> e & 1u) != 0 && anchors != 0)
            atomicAdd(histogram + depthBucket(__float_as_uint(fmaxf(viewPoint<float>(now.eyes[e], middle).z, 0.0f))),
                      anchors);
}

} // namespace gsc
