// SPDX-License-Identifier: Apache-2.0
// Converts floats to and from IEEE binary16 (half), which is held as its bits.
#pragma once

#include <gsc/hostdev.h>

#include <cmath>
#include <cstdint>
#include <cstring>

namespace gsc {

constexpr uint16_t kMaxHalfBits = 0x7bff; // bits of 65504, the largest finite half

GSC_HD float halfToFloat(uint16_t half)
{
    const uint32_t exponent = half >> 10 & 0x1fu, mantissa = half & 0x3ffu;
    const float magnitude =
        exponent == 0 ? std::ldexp(float(mantissa), -24) : std::ldexp(float(mantissa | 0x400u), int(exponent) - 25);
    return half & 0x8000u ? -magnitude : magnitude;
}

// Bits of the half nearest to `value`, on a tie the one with an even mantissa: infinity from 65520 on, a NaN for a NaN.
GSC_HD uint16_t floatToHalf(float value)
{
    uint32_t bits;
    std::memcpy(&bits, &value, sizeof(bits));
    const uint32_t sign = bits >> 16 & 0x8000u, magnitude = bits & 0x7fffffffu;
    if (magnitude > 0x7f800000u)
        return uint16_t(sign | 0x7e00u);
    if (magnitude >= 0x477ff000u)
        return uint16_t(sign | 0x7c00u);
    if (magnitude < 0x38800000u) // below 2^-14 a half is a multiple of 2^-24
        return uint16_t(sign | uint32_t(std::nearbyint(std::abs(value) * 0x1p24f)));
    // note: if the mantissa rounds up beyond its ten bits, the carry goes into the exponent, as it should
    return uint16_t(sign | (magnitude + 0xfffu + (magnitude >> 13 & 1u) - 0x38000000u) >> 13);
}

// Bits of the smallest half that is not below `value`, for bounds of zero or more: 65504 for larger values and NaN, 0
// for values below 0.
GSC_HD uint16_t floatToHalfUp(float value)
{
    if (!(value <= 65504.0f))
        return kMaxHalfBits;
    if (value <= 0)
        return 0;
    if (value < 0x1p-14f) // there a half is a multiple of 2^-24
        return uint16_t(std::ceil(value * 0x1p24f));
    int exponent;
    const float mantissa = std::frexp(value, &exponent); // mantissa in [0.5, 1)
    // note: if the mantissa rounds up to 2^11, the carry goes into the exponent, which gives the next half
    return uint16_t(uint32_t(exponent + 13) * 0x400u + uint32_t(std::ceil(mantissa * 2048.0f)));
}

} // namespace gsc
