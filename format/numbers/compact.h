// SPDX-License-Identifier: Apache-2.0
// Values that a GPU holds in few bits without loss: the values of an anchor are small whole numbers times a power of
// two (kModelCompact). The power is not stored; it follows from the anchor's largest value.
#pragma once

#include <gsc/hostdev.h>

#include <cstdint>
#include <cstring>

namespace gsc {

constexpr int kCompactFeatureBits = 7; // bits of a feature's number of steps, without the sign
constexpr int kCompactOffsetBits = 9;
constexpr int32_t kCompactFeatureSteps = (1 << kCompactFeatureBits) - 1; // largest number of steps of a feature
constexpr int32_t kCompactOffsetSteps = (1 << kCompactOffsetBits) - 1;
constexpr int kLeastCompactExponent = -24; // exponent of the smallest step, also the smallest positive half float

// Exponent of the finest step with which `largest` is at most 2^bits - 1 steps; at least -24. `largest` is the largest
// magnitude of an anchor's values. Precondition: `largest` is finite and not negative.
GSC_HD int compactExponent(float largest, int bits)
{
    uint32_t word;
    memcpy(&word, &largest, sizeof word);
    const int power = int(word >> 23) - 126; // largest = m 2^power / 2^24, with m in [2^23, 2^24)
    const uint32_t m = (word & 0x7fffffu) | 0x800000u;
    const int exponent = m <= (1u << 24) - (1u << (24 - bits)) ? power - bits : power - bits + 1;
    return exponent > kLeastCompactExponent ? exponent : kLeastCompactExponent;
}

// 2^exponent. Precondition: the result is a normal float.
GSC_HD float powerOfTwo(int exponent)
{
    const uint32_t word = uint32_t(exponent + 127) << 23;
    float value;
    memcpy(&value, &word, sizeof value);
    return value;
}

} // namespace gsc
