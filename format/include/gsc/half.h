// SPDX-License-Identifier: Apache-2.0
// IEEE binary16, as its bits.
#pragma once

#include <gsc/hostdev.h>

#include <cmath>
#include <cstdint>
#include <cstring>

namespace gsc {

constexpr uint16_t kMaxHalfBits = 0x7bff; // 65504, the largest finite one

GSC_HD float halfToFloat(uint16_t half)
{
    const uint32_t exponent = half >> 10 & 0x1fu, mantissa = half & 0x3ffu;
    const float magnitude =
        exponent == 0 ? std::ldexp(float(mantissa), -24) : std::ldexp(float(mantissa | 0x400u), int(exponent) - 25);
    return half & 0x8000u ? -magnitude : magnitude;
}

// The nearest half, the even one on a tie: infinity from 65520, a NaN for a NaN.
GSC_HD uint16_t floatToHalf(float value)
{
    uint32_t bits;
    std::memcpy(&bits, &value, sizeof(bits));
    const uint32_t sign = bits >> 16 & 0x8000u, magnitude = bits & 0x7fffffffu;
    if (magnitude > 0x7f800000u)
        return uint16_t(sign | 0x7e00u);
    if (magnitude >= 0x477ff000u)
        return uint16_t(sign | 0x7c00u);
    if (magnitude < 0x38800000u) // below 2^-14: a multiple of 2^-24
        return uint16_t(sign | uint32_t(std::nearbyint(std::abs(value) * 0x1p24f)));
    // note: a mantissa that rounds up beyond its ten bits carries into the exponent
    return uint16_t(sign | (magnitude + 0xfffu + (magnitude >> 13 & 1u) - 0x38000000u) >> 13);
}

// The smallest half that is not below `value`, for bounds of zero or more: 65504 beyond that and for NaN, 0 below 0.
GSC_HD uint16_t floatToHalfUp(float value)
{
    if (!(value <= 65504.0f))
        return kMaxHalfBits;
    if (value <= 0)
        return 0;
    if (value < 0x1p-14f) // a multiple of 2^-24
        return uint16_t(std::ceil(value * 0x1p24f));
    int exponent;
    const float mantissa = std::frexp(value, &exponent); // 0.5 or more, below 1
    // note: a mantissa that rounds up to 2^11 carries into the exponent, which is the next half
    return uint16_t(uint32_t(exponent + 13) * 0x400u + uint32_t(std::ceil(mantissa * 2048.0f)));
}

} // namespace gsc
