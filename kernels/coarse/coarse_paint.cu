// SPDX-License-Identifier: Apache-2.0
// FrameView::Detail of a frame with detail. After copies are made: those are of this frame. A Gaussian of a copy has the
// order of one of those that were joined, so it leads to the same group.
#include "kernels/coarse/coarse_cuda.h"
#include "kernels/present/paint.cuh"

namespace gsc {

namespace {

// As the frame has listed the group.
__device__ __forceinline__ GroupSource sourceOf(const PaintCoarseArgs& args, uint32_t index)
{
    const CoarseGroup& kept = args.tables.groups[index];
    if (CoarseKind(kept.kind) != CoarseKind::Far || kept.used != args.frame)
        return GroupSource::Near;
    if (kept.made == args.frame)
        return GroupSource::Made;
    const bool stale = coarseLook(args.view, args.paint.groups[index], kept, true).change > 1.0f;
    return stale ? GroupSource::Stale : GroupSource::Kept;
}

__global__ void __launch_bounds__(kPaintThreads) paintCoarseKernel(const __grid_constant__ PaintCoarseArgs args)
{
    paintAll<PackedSplat>(args.paint, [&](uint32_t, uint32_t source) {
        return detailColour(sourceOf(args, args.paint.origins[source] / kGroupSize));
    });
}

} // namespace

void paintCoarseCuda(const PaintCoarseArgs& args, uint32_t processors, CUstream_st* stream)
{
    launchCuda(paintCoarseKernel, processors * kPaintBlocks, kPaintThreads, 0, stream, args);
}

} // namespace gsc
