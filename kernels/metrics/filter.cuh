// SPDX-License-Identifier: Apache-2.0
// Filters: weighted sums of a value's neighbours, in double precision and in the order of the CPU's sums.
#pragma once

#include "kernels/metrics/scores_cuda.h"

namespace gsc {

__device__ __forceinline__ int32_t nearestInside(int32_t at, uint32_t count)
{
    return at < 0 ? 0 : at < int32_t(count) ? at : int32_t(count) - 1;
}

// Filters along a column of a plane; beyond the border the border's value is repeated.
__device__ __forceinline__ float columnSum(const float* plane, uint32_t width, uint32_t height, uint32_t x, uint32_t y,
                                           const FilterWeights& filter)
{
    double sum = 0;
    for (int32_t k = -filter.radius; k <= filter.radius; ++k)
        sum +=
            filter.weight[k + filter.radius] * double(plane[size_t(nearestInside(int32_t(y) + k, height)) * width + x]);
    return float(sum);
}

} // namespace gsc
