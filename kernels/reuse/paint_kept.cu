// SPDX-License-Identifier: Apache-2.0
// Paints FrameView::Age of a frame with reuse. Runs after decoding, so entries decoded in this frame have age 0.
#include "kernels/present/paint.cuh"
#include "kernels/reuse/reuse_stages_cuda.h"

namespace gsc {

namespace {

__global__ void __launch_bounds__(kPaintThreads) paintKeptKernel(const __grid_constant__ PaintKeptArgs args)
{
    paintAll<PackedSplat>(args.paint, [&](uint32_t eye, uint32_t source) {
        const uint32_t strip = args.paint.origins[source] / kStripAnchors;
        const uint32_t slot = args.tables.keptSlot(strip, args.merged ? 0 : eye);
        return ageColour(slot == kNoEntry ? 0u
                                          // a strip without an entry was decoded in this frame, so its age is 0
                                          : args.frame - args.tables.entries[slot].decoded);
    });
}

} // namespace

void paintKeptCuda(const PaintKeptArgs& args, uint32_t processors, CUstream_st* stream)
{
    launchCuda(paintKeptKernel, processors * kPaintBlocks, kPaintThreads, 0, stream, args);
}

} // namespace gsc
