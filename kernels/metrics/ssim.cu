// SPDX-License-Identifier: Apache-2.0
#include "kernels/metrics/block_sum.cuh"
#include "kernels/metrics/scores_cuda.h"
#include "kernels/metrics/ssim_rules.h"

namespace gsc {

namespace {

// Filters along rows; pixels outside of the picture count as 0.
__global__ void __launch_bounds__(kSquareThreads) ssimRowsKernel(const __grid_constant__ SsimCudaArgs args)
{
    const uint32_t width = args.pair.width, height = args.pair.height;
    const SquarePixel pixel = squarePixel(width, height);
    if (!pixel.there)
        return;
    double sums[5] = {};
    const int32_t radius = args.window.radius;
    for (int32_t k = -radius; k <= radius; ++k) {
        const int32_t x = int32_t(pixel.x) + k;
        if (x < 0 || x >= int32_t(width))
            continue;
        const size_t at = (size_t(pixel.y) * width + uint32_t(x)) * 3 + args.channel;
        const float a = args.pair.image[at], b = args.pair.exact[at], products[5] = {a, b, a * a, b * b, a * b};
        for (int plane = 0; plane < 5; ++plane)
            sums[plane] += args.window.weight[k + radius] * double(products[plane]);
    }
    for (int plane = 0; plane < 5; ++plane)
        args.planes[plane][pixel.at] = float(sums[plane]);
}

__global__ void __launch_bounds__(kSquareThreads) ssimColumnsKernel(const __grid_constant__ SsimCudaArgs args)
{
    __shared__ double shared[kSquareThreads];
    const uint32_t width = args.pair.width, height = args.pair.height;
    const SquarePixel pixel = squarePixel(width, height);
    double own = 0;
    if (pixel.there) {
        double sums[5] = {};
        const int32_t radius = args.window.radius;
        for (int32_t k = -radius; k <= radius; ++k) {
            const int32_t y = int32_t(pixel.y) + k;
            if (y < 0 || y >= int32_t(height))
                continue;
            const size_t at = size_t(y) * width + pixel.x;
            for (int plane = 0; plane < 5; ++plane)
                sums[plane] += args.window.weight[k + radius] * double(args.planes[plane][at]);
        }
        own = ssimPixel(float(sums[0]), float(sums[1]), float(sums[2]), float(sums[3]), float(sums[4]));
    }
    const double all = blockSum(own, shared, [](double& sum, double other) { sum += other; });
    if (threadIdx.x == 0)
        args.squares[squareNumber()] = all;
}

} // namespace

void ssimCuda(const SsimCudaArgs& args, CUstream_st* stream)
{
    const dim3 squares = squaresOf(args.pair.width, args.pair.height);
    launchCuda(ssimRowsKernel, squares, kSquareThreads, 0, stream, args);
    launchCuda(ssimColumnsKernel, squares, kSquareThreads, 0, stream, args);
}

} // namespace gsc
