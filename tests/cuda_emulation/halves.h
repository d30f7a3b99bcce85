// SPDX-License-Identifier: Apache-2.0
// Halves to floats and back, to nearest even.
#pragma once

#include <bit>
#include <cstdint>

namespace gsc_emulation {

inline uint16_t halfOfFloat(float v)
{
    uint32_t bits = std::bit_cast<uint32_t>(v);
    const uint32_t sign = bits >> 16 & 0x8000u;
    bits &= 0x7fffffffu;
    if (bits > 0x7f800000u)
        return 0x7fff; // CUDA's one NaN
    if (bits >= 0x477ff000u)
        return uint16_t(sign | 0x7c00u);
    if (bits < 0x38800000u) // a unit in the last place of 1/2 is the smallest half
        return uint16_t(sign | (std::bit_cast<uint32_t>(std::bit_cast<float>(bits) + 0.5f) - 0x3f000000u));
    bits += 0xfffu + (bits >> 13 & 1u);
    return uint16_t(sign | ((bits - (112u << 23)) >> 13));
}

inline float floatOfHalf(uint16_t half)
{
    const uint32_t sign = uint32_t(half & 0x8000u) << 16, rest = half & 0x7fffu;
    if (rest >= 0x7c00u)
        return std::bit_cast<float>(sign | 0x7f800000u | (rest & 0x3ffu) << 13);
    if (rest >= 0x400u)
        return std::bit_cast<float>(sign | ((rest << 13) + (112u << 23)));
    const float v = float(rest) * 0x1p-24f;
    return sign != 0 ? -v : v;
}

} // namespace gsc_emulation
