// SPDX-License-Identifier: Apache-2.0
#include "kernels/metrics/block_sum.cuh"
#include "kernels/metrics/scores_cuda.h"

namespace gsc {

namespace {

__global__ void __launch_bounds__(kSquareThreads) squareSumsKernel(const __grid_constant__ SquareSumsCudaArgs args)
{
    __shared__ SquareSums shared[kSquareThreads];
    const SquarePixel pixel = squarePixel(args.pair.width, args.pair.height);
    SquareSums own{};
    if (pixel.there) {
        const size_t at = 3 * pixel.at;
        addPixel(own, args.gaze.present && inFovea(args.gaze.gaze, pixel.x, pixel.y), args.pair.image + at,
                 args.pair.exact + at, args.last_error + at, args.last_image + at);
    }
    const SquareSums all = blockSum(own, shared, [](SquareSums& sum, const SquareSums& other) { addSums(sum, other); });
    if (threadIdx.x == 0)
        args.squares[squareNumber()] = all;
}

} // namespace

void squareSumsCuda(const SquareSumsCudaArgs& args, CUstream_st* stream)
{
    launchCuda(squareSumsKernel, squaresOf(args.pair.width, args.pair.height), kSquareThreads, 0, stream, args);
}

} // namespace gsc
