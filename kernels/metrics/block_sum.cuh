// SPDX-License-Identifier: Apache-2.0
// Adds up values of a picture's pixels in a fixed order: one block for each square of the picture, one thread for each
// pixel of the square.
#pragma once

#include "kernels/cuda/launch.cuh"
#include "kernels/metrics/square_sums.h"

namespace gsc {

constexpr uint32_t kSquareThreads = kScoreSquare * kScoreSquare;

struct SquarePixel {
    uint32_t x, y;
    size_t at; // index of the pixel in a plane
    bool there;
};

__device__ __forceinline__ SquarePixel squarePixel(uint32_t width, uint32_t height)
{
    const uint32_t x = blockIdx.x * kScoreSquare + threadIdx.x % kScoreSquare;
    const uint32_t y = blockIdx.y * kScoreSquare + threadIdx.x / kScoreSquare;
    return {x, y, size_t(y) * width + x, x < width && y < height};
}

__device__ __forceinline__ uint32_t squareNumber()
{
    return blockIdx.y * gridDim.x + blockIdx.x;
}

inline dim3 squaresOf(uint32_t width, uint32_t height)
{
    return dim3((width + kScoreSquare - 1) / kScoreSquare, (height + kScoreSquare - 1) / kScoreSquare);
}

// Adds up the `own` of all threads of a block, each of which must call it; `add` adds its second argument to its first.
// Only thread 0 gets the sum.
template <typename Sum, typename Add>
__device__ __forceinline__ Sum blockSum(const Sum& own, Sum* shared, const Add& add)
{
    shared[threadIdx.x] = own;
    __syncthreads();
    for (uint32_t half = kSquareThreads / 2; half > 0; half /= 2) {
        if (threadIdx.x < half)
            add(shared[threadIdx.x], shared[threadIdx.x + half]);
        __syncthreads();
    }
    return shared[0];
}

} // namespace gsc
