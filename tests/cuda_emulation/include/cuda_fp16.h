// SPDX-License-Identifier: Apache-2.0
// Stands for the CUDA toolkit's header.
#pragma once

#include "tests/cuda_emulation/halves.h"
#include "tests/cuda_emulation/vector_types.h"

struct __half {
    uint16_t bits;
};
struct alignas(4) __half2 {
    __half x, y;
};

inline __half __float2half_rn(float v)
{
    return {gsc_emulation::halfOfFloat(v)};
}
inline float __half2float(__half v)
{
    return gsc_emulation::floatOfHalf(v.bits);
}
inline __half2 __floats2half2_rn(float x, float y)
{
    return {__float2half_rn(x), __float2half_rn(y)};
}
inline float2 __half22float2(__half2 v)
{
    return {__half2float(v.x), __half2float(v.y)};
}
inline uint16_t __half_as_ushort(__half v)
{
    return v.bits;
}
inline __half __ushort_as_half(uint16_t bits)
{
    return {bits};
}
inline __half2 __hsub2(__half2 a, __half2 b)
{
    const float2 l = __half22float2(a), r = __half22float2(b);
    return __floats2half2_rn(l.x - r.x, l.y - r.y);
}
inline __half2 __hmul2(__half2 a, __half2 b)
{
    const float2 l = __half22float2(a), r = __half22float2(b);
    return __floats2half2_rn(l.x * r.x, l.y * r.y);
}
