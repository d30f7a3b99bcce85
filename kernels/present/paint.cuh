// SPDX-License-Identifier: Apache-2.0
// Loop over the splats of a pass that paints them in other colours.
#pragma once

#include "kernels/cuda/halves.cuh"
#include "kernels/cuda/launch.cuh"
#include "kernels/present/false_colour.h"
#include "kernels/present/paint_cuda.h"

namespace gsc {

constexpr uint32_t kPaintThreads = 256, kPaintBlocks = 4; // kPaintBlocks: blocks per multiprocessor

__device__ __forceinline__ void paint(PackedSplat& splat, const FalseColour& colour)
{
    const uint32_t rg = packSteps(colour.r, colour.g);
    splat.color[0] = uint16_t(rg & 0xffffu);
    splat.color[1] = uint16_t(rg >> 16);
    splat.color[2] = uint16_t(packSteps(colour.b, 0.0f));
}

__device__ __forceinline__ void paint(ExactSplat& splat, const FalseColour& colour)
{
    splat.color[0] = colour.r;
    splat.color[1] = colour.g;
    splat.color[2] = colour.b;
}

// Sets the colour of every splat in a slot of the pass to colourOf(eye, source index).
template <typename Splat, typename ColourOf>
__device__ __forceinline__ void paintAll(const PaintCudaArgs& args, const ColourOf& colourOf)
{
    if (willRepeat(*args.counters))
        return;
    for (uint32_t e = 0; e < args.eye_count; ++e) {
        const uint32_t list = args.shared_bins ? 0u : e;
        const uint32_t slots = min(args.counters->pass.slots[list], args.slot_capacity);
        const SplatPlace* const places = args.places + size_t(list) * args.slot_capacity;
        Splat* const splats = static_cast<Splat*>(args.splats) + size_t(e) * args.slot_capacity;
        for (uint32_t i = blockIdx.x * kPaintThreads + threadIdx.x; i < slots; i += gridDim.x * kPaintThreads)
            if (places[i].box != kNoBins)
                paint(splats[i], colourOf(e, splats[i].order / args.n_offsets));
    }
}

} // namespace gsc
