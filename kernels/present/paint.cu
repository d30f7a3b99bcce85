// SPDX-License-Identifier: Apache-2.0
#include "kernels/present/paint.cuh"

#include <algorithm>

namespace gsc {

namespace {

template <typename Splat>
__global__ void __launch_bounds__(kPaintThreads) paintKernel(const __grid_constant__ PaintCudaArgs args)
{
    paintAll<Splat>(args, [&](uint32_t, uint32_t source) {
        return args.origins == nullptr
                   ? args.colour
                   : levelColour(args.levels[args.groups[args.origins[source] / kGroupSize].level_index].level);
    });
}

__global__ void __launch_bounds__(kPaintThreads) costKernel(const __grid_constant__ CostCudaArgs args)
{
    if (willRepeat(*args.counters))
        return;
    float* const image = args.image[blockIdx.y];
    for (uint32_t i = blockIdx.x * kPaintThreads + threadIdx.x; i < args.pixels[blockIdx.y];
         i += gridDim.x * kPaintThreads) {
        const float count = image[size_t(3) * i]; // in columns that are not drawn this may be any value
        const FalseColour colour = costColour(count > 0.0f && count < 1e9f ? uint32_t(count) : 0u);
        image[size_t(3) * i] = colour.r;
        image[size_t(3) * i + 1] = colour.g;
        image[size_t(3) * i + 2] = colour.b;
    }
}

} // namespace

void paintSplatsCuda(const PaintCudaArgs& args, uint32_t processors, CUstream_st* stream)
{
    launchCuda(args.exact ? paintKernel<ExactSplat> : paintKernel<PackedSplat>, processors * kPaintBlocks,
               kPaintThreads, 0, stream, args);
}

void paintCostCuda(const CostCudaArgs& args, uint32_t processors, CUstream_st* stream)
{
    launchCuda(costKernel, dim3(processors * kPaintBlocks, args.eye_count), kPaintThreads, 0, stream, args);
}

} // namespace gsc
