// SPDX-License-Identifier: Apache-2.0
// Two 16-bit numbers in a word: half floats, or numbers of steps for values from 0 to 1.
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

// Two half floats of a word as floats; x is the one in the low bits.
__device__ __forceinline__ float2 halvesOf(uint32_t word)
{
    return __half22float2(reinterpret_cast<const __half2&>(word));
}

// Packs two values from 0 to 1 in steps of 1/65535: 32 times as fine as half floats near 1, coarser below 1/64, where
// less is visible. Adding 2^23 rounds to a whole number, which stands in the sum's low bits: a conversion takes four
// times as long.
__device__ __forceinline__ uint32_t packSteps(float low, float high)
{
    const uint32_t a = __float_as_uint(fmaf(low, 65535.0f, 0x1p23f)),
                   b = __float_as_uint(fmaf(high, 65535.0f, 0x1p23f));
    return __byte_perm(a, b, 0x5410);
}

__device__ __forceinline__ float2 stepsOf(uint32_t word)
{
    return {float(word & 0xffffu) * (1.0f / 65535.0f), float(word >> 16) * (1.0f / 65535.0f)};
}

} // namespace gsc
