// SPDX-License-Identifier: Apache-2.0
// Paints FrameView::Detail and FrameView::Age of a frame with detail. Runs after copies were made, so new copies count
// as of this frame. A joined Gaussian has the emission order of one of its sources, so it leads to their group.
#include "kernels/coarse/coarse_cuda.h"
#include "kernels/present/paint.cuh"

namespace gsc {

namespace {

// Returns true if the frame draws the group from its copy.
__device__ __forceinline__ bool isCopied(const PaintCoarseArgs& args, const CoarseGroup& kept)
{
    return CoarseKind(kept.kind) == CoarseKind::Far && kept.used == args.frame;
}

__device__ __forceinline__ GroupSource sourceOf(const PaintCoarseArgs& args, uint32_t index)
{
    const CoarseGroup& kept = args.tables.groups[index];
    if (!isCopied(args, kept))
        return GroupSource::Near;
    if (kept.made == args.frame)
        return GroupSource::Made;
    const bool stale = coarseLook(args.view, args.paint.groups[index], kept, true).change > 1.0f;
    return stale ? GroupSource::Stale : GroupSource::Kept;
}

__device__ __forceinline__ uint32_t ageOf(const PaintCoarseArgs& args, uint32_t index)
{
    const CoarseGroup& kept = args.tables.groups[index];
    return isCopied(args, kept) ? args.frame - kept.made : 0u;
}

__global__ void __launch_bounds__(kPaintThreads) paintCoarseKernel(const __grid_constant__ PaintCoarseArgs args)
{
    paintAll<PackedSplat>(args.paint, [&](uint32_t, uint32_t source) {
        const uint32_t index = args.paint.origins[source] / kGroupSize;
        return args.ages ? ageColour(ageOf(args, index)) : detailColour(sourceOf(args, index));
    });
}

} // namespace

void paintCoarseCuda(const PaintCoarseArgs& args, uint32_t processors, CUstream_st* stream)
{
    launchCuda(paintCoarseKernel, processors * kPaintBlocks, kPaintThreads, 0, stream, args);
}

} // namespace gsc
