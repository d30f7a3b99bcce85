// SPDX-License-Identifier: Apache-2.0
#include "format/numbers/morton.h"

#include <doctest/doctest.h>

#include <random>

using namespace gsc;

namespace {

uint64_t naiveMorton(uint32_t x, uint32_t y, uint32_t z)
{
    uint64_t key = 0;
    for (int bit = 0; bit < 21; ++bit)
        key |= uint64_t(x >> bit & 1) << (3 * bit) | uint64_t(y >> bit & 1) << (3 * bit + 1) |
               uint64_t(z >> bit & 1) << (3 * bit + 2);
    return key;
}

} // namespace

TEST_CASE("morton keys interleave x, y, z from the lowest bit")
{
    std::mt19937 random(1);
    CHECK(mortonEncode(1, 0, 0) == 1);
    CHECK(mortonEncode(0, 1, 0) == 2);
    CHECK(mortonEncode(0, 0, 1) == 4);
    for (int i = 0; i < 10000; ++i) {
        const uint32_t x = random() & 0x1fffff, y = random() & 0x1fffff, z = random() & 0x1fffff;
        const uint64_t key = mortonEncode(x, y, z);
        REQUIRE(key == naiveMorton(x, y, z));
        REQUIRE(gatherBits3(key) == x);
        REQUIRE(gatherBits3(key >> 1) == y);
        REQUIRE(gatherBits3(key >> 2) == z);
    }
}

TEST_CASE("signed keys nest: the node of a coordinate is its shifted key")
{
    std::mt19937 random(2);
    for (int i = 0; i < 10000; ++i) {
        int32_t c[3], corner[3];
        for (int32_t& value : c)
            value = int32_t(random() % (2u << 20)) - kMortonBias;
        for (uint32_t shift = 0; shift <= 9; ++shift) {
            mortonCorner(mortonKey(c[0], c[1], c[2]) >> 3 * shift, shift, corner);
            for (int axis = 0; axis < 3; ++axis)
                REQUIRE(corner[axis] == c[axis] >> shift << shift);
        }
    }
    CHECK(mortonKey(-1, 0, 0) < mortonKey(0, 0, 0));
    CHECK(mortonKey(5, -3, 0) < mortonKey(-5, 3, 0)); // the later axis decides
}
