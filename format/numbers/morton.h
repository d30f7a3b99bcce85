// SPDX-License-Identifier: Apache-2.0
// Morton keys of signed cell coordinates: the bits of x, y and z alternate, x in the lowest bit of each three, then y,
// then z.
#pragma once

#include <cstdint>

namespace gsc {

// added to coordinates: those in [-2^20, 2^20) then keep their order and nesting
constexpr int32_t kMortonBias = 1 << 20;

// Moves bit i of the low 21 bits to bit 3 i.
constexpr uint64_t spreadBits3(uint64_t value)
{
    value &= 0x1fffff;
    value = (value | value << 32) & 0x001f00000000ffff;
    value = (value | value << 16) & 0x001f0000ff0000ff;
    value = (value | value << 8) & 0x100f00f00f00f00f;
    value = (value | value << 4) & 0x10c30c30c30c30c3;
    value = (value | value << 2) & 0x1249249249249249;
    return value;
}

constexpr uint32_t gatherBits3(uint64_t value)
{
    value &= 0x1249249249249249;
    value = (value | value >> 2) & 0x10c30c30c30c30c3;
    value = (value | value >> 4) & 0x100f00f00f00f00f;
    value = (value | value >> 8) & 0x001f0000ff0000ff;
    value = (value | value >> 16) & 0x001f00000000ffff;
    value = (value | value >> 32) & 0x1fffff;
    return uint32_t(value);
}

constexpr uint64_t mortonEncode(uint32_t x, uint32_t y, uint32_t z)
{
    return spreadBits3(x) | spreadBits3(y) << 1 | spreadBits3(z) << 2;
}

// Key of a cell. A node 2^s cells wide has the key of any of its cells >> 3 s, because the bias is a power of two.
constexpr uint64_t mortonKey(int32_t x, int32_t y, int32_t z)
{
    return mortonEncode(uint32_t(x + kMortonBias), uint32_t(y + kMortonBias), uint32_t(z + kMortonBias));
}

// Smallest coordinates of a node, in units of its width 2^shift, from its key mortonKey(x, y, z) >> 3 * shift.
constexpr void mortonCorner(uint64_t key, uint32_t shift, int32_t corner[3])
{
    for (uint32_t axis = 0; axis < 3; ++axis)
        corner[axis] = int32_t(gatherBits3(key >> axis) << shift) - kMortonBias;
}

} // namespace gsc
