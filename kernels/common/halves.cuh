// SPDX-License-Identifier: Apache-2.0
// Two halves in a word.
#pragma once

#include <cuda_fp16.h>
#include <cuda_runtime.h>

#include <cstdint>

namespace gsc {

__device__ __forceinline__ uint32_t packHalves(float low, float high)
{
    const __half2 h = __floats2half2_rn(low, high);
    return reinterpret_cast<const uint32_t&>(h);
}

// x: the low one.
__device__ __forceinline__ float2 halvesOf(uint32_t word)
{
    return __half22float2(reinterpret_cast<const __half2&>(word));
}

} // namespace gsc
