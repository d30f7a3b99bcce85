// SPDX-License-Identifier: Apache-2.0
#include "kernels/reuse/reuse_stages_cuda.h"

#include "kernels/select/anchor_kernel.cuh"

namespace gsc {

namespace {

// Lists visible strips, for the kernel in anchor_kernel.cuh: one entry for each strip with a visible anchor.
struct ListStrips {
    using Args = StripSelectArgs;

    static __device__ __forceinline__ uint32_t entries(uint32_t any)
    {
        return uint32_t((any & 0xffffu) != 0) + uint32_t(any >> 16 != 0);
    }

    static __device__ __forceinline__ uint32_t* length(const Args& args) { return &args.tables.counters->strips; }

    // Anchors of a strip, for both eyes a bit each, that were not visible in the frame before.
    static __device__ __forceinline__ uint32_t freshLanes(const Args& args, const ListedStrip& listed)
    {
        const SeenStrip before = args.tables.seen[(args.frame - 1) & 1u][listed.strip];
        args.tables.seen[args.frame & 1u][listed.strip] = {listed.lanes, args.frame};
        return __popc(listed.lanes & ~(before.frame == args.frame - 1 ? before.lanes : 0u));
    }

    static __device__ __forceinline__ uint32_t list(const Args& args, const WarpOfGroup& warp, const float* fraction)
    {
        const uint32_t lane = threadIdx.x & 31u;
        if ((warp.any >> (lane & 16u) & 0xffffu) == 0) // true if no anchor of this lane's strip is visible
            return 0;
        const uint32_t slot = warp.slot + (lane < 16 ? 0u : uint32_t((warp.any & 0xffffu) != 0));
        if (args.fraction != nullptr)
            for (uint32_t e = 0; e < kMaxEyes; ++e)
                args.fraction[(size_t(slot) * kMaxEyes + e) * kStripAnchors + (lane & 15u)] = fraction[e];
        if ((lane & 15u) != 0)
            return 0;
        const ListedStrip listed{warp.index * kStripsPerGroup + threadIdx.x / kStripAnchors, warp.anchor,
                                 (warp.left >> lane & 0xffffu) | (warp.right >> lane) << 16,
                                 min(warp.group.anchor_count - threadIdx.x, kStripAnchors)};
        args.tables.listed[slot] = listed;
        return freshLanes(args, listed);
    }

    static __device__ __forceinline__ void finish(const Args& args, uint32_t fresh)
    {
        if (fresh != 0)
            atomicAdd(&args.tables.counters->fresh, fresh);
    }
};

} // namespace

void selectStripsCuda(const StripSelectArgs& args, uint32_t processors, CUstream_st* stream)
{
    launchAnchors<ListStrips>(args, processors, stream);
}

} // namespace gsc
