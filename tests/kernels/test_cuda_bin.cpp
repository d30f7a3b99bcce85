// SPDX-License-Identifier: Apache-2.0
// Slabs, cells, pieces and the queue of bins, from places made by hand.
#include "tests/kernels/gpu_bin.h"

#include <doctest/doctest.h>

#include <cmath>

using namespace gsc;
using namespace gsc::test;

namespace {

std::vector<uint16_t> slabsOnDevice(const std::vector<uint32_t>& histogram, uint32_t slabs)
{
    const GuardedBuffer<uint32_t> counts(histogram);
    const GuardedBuffer<uint16_t> slab_of(kDepthBuckets);
    slabCuda({counts.get(), slab_of.get(), slabs}, testStream().handle);
    CHECK(counts.intact());
    CHECK(slab_of.intact());
    std::vector<uint16_t> result = slab_of.read();
    CHECK(std::is_sorted(result.begin(), result.end()));
    CHECK(result.back() < slabs);
    return result;
}

} // namespace

TEST_CASE("bin: slots around the edges of warps and blocks, one and two eyes, both bin heights")
{
    for (const uint32_t slots : {0u, 1u, 31u, 32u, 33u, 255u, 257u, 1000u})
        for (const uint32_t eye_count : {1u, 2u}) {
            CAPTURE(slots);
            CAPTURE(eye_count);
            checkWithRoom(randomPlaces({5, 7, 16, 3}, eye_count, slots, slots + 9, slots + eye_count));
        }
    // more slots reserved than there are: decode has said so
    Places cut = randomPlaces({5, 7, 16, 3}, 2, 300, 200, 5);
    checkWithRoom(cut);
    cut.slots[1] = 11; // eyes that differ
    checkWithRoom(cut);
}

TEST_CASE("bin: grids from one bin to the largest, slabs from 4 to many")
{
    for (const BinGrid& grid : {BinGrid{1, 1, 16, 2},
                                {1, 1, 32, 10},
                                {2, 1, 16, 2},
                                {kMaxBins, 1, 16, 2},
                                {1, kMaxBins, 32, 4},
                                {kMaxBins, kMaxBins, 16, 2}}) {
        CAPTURE(grid.columns);
        CAPTURE(grid.rows);
        CAPTURE(grid.slab_bits);
        const bool large = grid.bins() > 10000; // a box of them all is a list of its own
        checkWithRoom(randomPlaces(grid, 1, large ? 40 : 333, 400, 3 + grid.columns));
    }
}

TEST_CASE("bin: a splat of one bin, of 4, of 5 and of all, alone and beside others in its warp")
{
    const BinGrid grid{6, 5, 16, 2};
    for (const uint32_t box :
         {0u, 5u << 16 | 5u | 4u << 8 | 4u << 24, 1u << 16 | 1u << 24, 4u << 16, 5u << 16 | 4u << 24})
        for (const uint32_t copies : {1u, 2u, 32u, 40u}) {
            CAPTURE(box);
            CAPTURE(copies);
            Places p = emptyPlaces(grid, 1, 64, 64);
            for (uint32_t i = 0; i < copies; ++i)
                p.places[(i * 7 + 3) % 64] = {floatBits(1.0f + float(i)), box};
            checkWithRoom(p);
        }
}

TEST_CASE("bin: splats of many bins, as many as are listed and more, beside others")
{
    struct Case {
        BinGrid grid;
        uint32_t slots, columns, rows; // bins of a wide one
    };
    // more than the threads of all parts of one, and more splats than the list holds
    for (const Case& c : {Case{{20, 61, 16, 2}, 40, 20, 60}, Case{{15, 11, 16, 2}, kWideSplats + 400, 14, 10}})
        for (const uint32_t eye_count : {1u, 2u}) {
            CAPTURE(c.slots);
            CAPTURE(eye_count);
            Places p = emptyPlaces(c.grid, eye_count, c.slots, c.slots + 5);
            for (uint32_t e = 0; e < eye_count; ++e)
                for (uint32_t i = 0; i < c.slots; ++i) {
                    const uint32_t wide = e << 8 | (c.columns - 1) << 16 | (c.rows - 1 + e) << 24;
                    p.places[e * p.slot_capacity + i] = {floatBits(1.0f + 0.01f * float(i)),
                                                         i % 16 == 0 ? 3u | 3u << 16 : wide};
                }
            checkWithRoom(p);
        }
}

TEST_CASE("bin: long lists are cut where cells begin, into pieces of every class")
{
    // from spread evenly, over a few full cells, to all in one
    for (const float spread : {60.0f, 3.0f, 0.3f, 0.0f})
        for (const uint32_t slots : {257u, 1025u, 2050u, 4097u, 9000u}) {
            CAPTURE(spread);
            CAPTURE(slots);
            Places p = emptyPlaces({2, 2, 16, 5}, 1, slots, slots);
            Random random(slots);
            for (uint32_t i = 0; i < slots; ++i)
                p.places[i] = {floatBits(2 + spread * random.uniform()),
                               i % 50 == 0 ? 1u << 16 | 1u << 24 : 1u | 1u << 16};
            checkWithRoom(p);
        }
}

TEST_CASE("bin: runs that begin and end in any cell, beside bins without keys")
{
    for (const uint32_t slab_bits : {2u, 5u, 6u, 7u, 8u, 10u}) {
        CAPTURE(slab_bits);
        const uint32_t slabs = 1u << slab_bits;
        std::vector<SplatPlace> places;
        const auto put = [&](uint32_t bin, uint32_t slab, uint32_t keys) {
            const uint32_t x = bin % 4, y = bin / 4; // evenSlabs(): 6 octaves
            const uint32_t depth = floatBits(1.0f) + (uint32_t((float(slab) + 0.5f) * 6144 / float(slabs)) << 13);
            places.insert(places.end(), keys, {depth, x | y << 8 | x << 16 | y << 24});
        };
        for (uint32_t slab = 0; slab < slabs; ++slab) { // 4 is as full as it can be, 5 cut every few cells
            put(4, slab, slabs <= 256 ? kPieceAim : kPieceAim / 8);
            put(5, slab, slab % 5 * 100);
            put(6, slab, slab % 17 == 3);
        }
        put(1, slabs - 1, 700);
        put(2, 0, 700);
        put(3, 0, kPieceAim);
        put(3, slabs - 1, 2);
        for (const uint32_t around : {slabs / 4, slabs / 2, slabs / 4 * 3}) { // where warps go on
            put(7, around - 1, kPieceAim - 1);
            put(8, around, kPieceAim);
            put(9, around - 1, kPieceAim);
            put(9, around, 1);
        }
        put(10, slabs - 1, 1);
        // none in 0 and 11, the first and the last
        Places p = emptyPlaces({4, 3, 16, slab_bits}, 1, uint32_t(places.size()), uint32_t(places.size()));
        p.places = places;
        const uint32_t needed = Expected(p).ends.back();
        for (const uint32_t capacity : {needed + 5, needed - 1, needed / 2, needed / 7}) {
            CAPTURE(capacity);
            checkBin(p, capacity);
        }
    }
}

TEST_CASE("bin: a cell as long as a class of pieces ends")
{
    for (const uint32_t slots : {1u, 2u, 511u, 512u, 513u, 1024u, 1025u, 2048u, 2049u, 4096u, 4097u, 8192u, 8193u}) {
        CAPTURE(slots);
        Places p = emptyPlaces({2, 2, 16, 3}, 1, slots, slots);
        for (SplatPlace& place : p.places)
            place = {floatBits(7), 1u | 1u << 16};
        checkWithRoom(p);
    }
}

TEST_CASE("bin: too few keys are filled, not overrun, and it is said")
{
    const Places p = randomPlaces({5, 7, 16, 3}, 2, 700, 700, 99);
    const uint32_t needed = Expected(p).ends.back();
    REQUIRE(needed > 3000);
    for (const uint32_t capacity : {needed, needed - 1, needed / 2, 1025u, 1u}) {
        CAPTURE(capacity);
        checkBin(p, capacity);
    }
    // every piece of a long list that is cut
    Places deep = emptyPlaces({1, 1, 16, 5}, 1, 5000, 5000);
    for (uint32_t i = 0; i < 5000; ++i)
        deep.places[i] = {floatBits(1.0f + 0.0126f * float(i)), 0};
    for (const uint32_t capacity : {4999u, 2100u, 1000u, 2u, 1u}) {
        CAPTURE(capacity);
        checkBin(deep, capacity);
    }
}

TEST_CASE("slabs: none for an empty histogram, the middle for one bucket, monotone and in range")
{
    std::vector<uint32_t> histogram(kDepthBuckets, 0);
    const std::vector<uint16_t> empty = slabsOnDevice(histogram, 64);
    CHECK(empty == std::vector<uint16_t>(kDepthBuckets, empty[0]));
    for (const uint32_t bucket : {0u, 31u, 32u, 20000u, kDepthBuckets - 1})
        for (const uint32_t slabs : {4u, 64u, kMaxSlabs * kMaxPasses}) {
            CAPTURE(bucket);
            CAPTURE(slabs);
            std::fill(histogram.begin(), histogram.end(), 0);
            histogram[bucket] = 128;
            const std::vector<uint16_t> slab_of = slabsOnDevice(histogram, slabs);
            CHECK(slab_of[bucket] == slabs / 2);
            CHECK((bucket == 0 || slab_of[bucket - 1] == 0));
            CHECK((bucket == kDepthBuckets - 1 || slab_of[bucket + 1] == slabs - 1));
        }
}

TEST_CASE("slabs: equal loads to within a bucket")
{
    for (const uint32_t largest : {3u, 100u, 200000u}) // the last sums to more than a float counts exactly
        for (const uint32_t slabs : {4u, 16u, 3u * 256, kMaxSlabs}) {
            CAPTURE(largest);
            CAPTURE(slabs);
            Random random(largest + slabs);
            std::vector<uint32_t> histogram(kDepthBuckets, 0);
            for (uint32_t b = 3000; b < 25000; ++b)
                if (random.uniform() < 0.6f)
                    histogram[b] = uint32_t(random.uniform() * float(largest)) + (b == 9000 ? 3 * largest : 0);
            const std::vector<uint16_t> slab_of = slabsOnDevice(histogram, slabs);
            std::vector<uint64_t> load(slabs, 0);
            uint64_t total = 0;
            uint32_t grain = 0;
            for (uint32_t b = 0; b < kDepthBuckets; ++b) {
                load[slab_of[b]] += histogram[b];
                total += histogram[b];
                grain = std::max(grain, histogram[b]);
            }
            const double fair = double(total) / slabs, slack = grain + double(total) * 2e-7 + 1;
            bool equal = true;
            for (const uint64_t l : load)
                equal &= std::abs(double(l) - fair) <= slack;
            CHECK(equal);
        }
}

TEST_CASE("bin: long lists are told from others and have units, for every eye that reads them")
{
    for (const uint32_t readers : {1u, 2u})
        for (const uint32_t longest : {kLongList - 1, kLongList, 2 * kLongList, 70001u}) {
            CAPTURE(readers);
            CAPTURE(longest);
            Places p = emptyPlaces({3, 2, 16, 6}, 1, longest + kLongList + 100, longest + kLongList + 100);
            Random random(longest);
            for (uint32_t i = 0; i < p.places.size(); ++i) {
                const uint32_t x = i < longest ? 1u : i < longest + kLongList ? 2u : 0u;
                p.places[i] = {floatBits(2 + 60 * random.uniform()), x | x << 16};
            }
            checkBin(p, Expected(p).ends.back() + 5, readers);
            if (longest == 70001)
                checkBin(p, Expected(p).ends.back() - 1, readers); // drawn again
        }
}
