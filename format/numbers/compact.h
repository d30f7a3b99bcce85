// SPDX-License-Identifier: Apache-2.0
// Values that a GPU holds in few bits without loss: small whole numbers times a power of two, one for each anchor
// (kModelCompact). The power is not stored, it follows from the largest of the values.
#pragma once

#include <gsc/hostdev.h>

#include <cstdint>
#include <cstring>

namespace gsc {

constexpr int kCompactFeatureBits = 7; // beside the sign
constexpr int kCompactOffsetBits = 9;
constexpr int32_t kCompactFeatureSteps = (1 << kCompactFeatureBits) - 1; // at most
constexpr int32_t kCompactOffsetSteps = (1 << kCompactOffsetBits) - 1;
constexpr int kLeastCompactExponent = -24; // exponent of the least step: the least power of two that a half can be

// Exponent of the finest step, a power of two from 2^-24 up, of which `largest` is at most 2^bits - 1. `largest` is the
// largest magnitude of an anchor's values. Precondition: it is finite and not negative.
GSC_HD int compactExponent(float largest, int bits)
{
    uint32_t word;
    memcpy(&word, &largest, sizeof word);
    const int power = int(word >> 23) - 126; // largest = m 2^power / 2^24, m from 2^23 up to 2^24
    const uint32_t m = (word & 0x7fffffu) | 0x800000u;
    const int exponent = m <= (1u << 24) - (1u << (24 - bits)) ? power - bits : power - bits + 1;
    return exponent > kLeastCompactExponent ? exponent : kLeastCompactExponent;
}

// 2^exponent, of a normal float.
GSC_HD float powerOfTwo(int exponent)
{
    const uint32_t word = uint32_t(exponent + 127) << 23;
    float value;
    memcpy(&value, &word, sizeof value);
    return value;
}

} // namespace gsc
