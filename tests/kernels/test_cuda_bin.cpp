// SPDX-License-Identifier: Apache-2.0
// Slabs, cells, pieces and the queue of bins, from places made by hand.
#include "kernels/bin/bin_cuda.h"
#include "tests/kernels/gpu_stage.h"

#include <doctest/doctest.h>

#include <bit>
#include <map>
#include <set>
#include <tuple>

using namespace gsc;
using namespace gsc::test;

namespace {

struct Places {
    BinGrid grid;
    uint32_t eye_count;
    uint32_t slots[kMaxEyes]; // reserved, may exceed the capacity
    uint32_t slot_capacity;
    std::vector<SplatPlace> places; // eye_count x slot_capacity
    std::vector<uint16_t> slab_of;
};

constexpr uint32_t kOtherPass = 5; // slabs are numbered over all passes: only their low bits name a cell

Places emptyPlaces(const BinGrid& grid, uint32_t eye_count, uint32_t slots, uint32_t slot_capacity)
{
    Places p{grid, eye_count, {slots, eye_count == 2 ? slots : 0}, slot_capacity, {}, {}};
    p.places.assign(size_t(eye_count) * slot_capacity, {0x7fffffffu, 0u}); // in bin 0 if read beyond the slots
    for (uint32_t e = 0; e < eye_count; ++e)
        std::fill_n(p.places.begin() + e * slot_capacity, std::min(slots, slot_capacity), SplatPlace{0, kNoBins});
    p.slab_of = evenSlabs(1, 64, grid.slabs());
    for (uint16_t& slab : p.slab_of)
        slab = uint16_t(slab + kOtherPass * grid.slabs());
    return p;
}

// Boxes of one bin, of a few, of the whole grid, and none, at random.
Places randomPlaces(const BinGrid& grid, uint32_t eye_count, uint32_t slots, uint32_t slot_capacity, uint32_t seed)
{
    Places p = emptyPlaces(grid, eye_count, slots, slot_capacity);
    Random random(seed);
    const auto below = [&random](uint32_t n) { return uint32_t(random.uniform() * float(n)); };
    for (uint32_t e = 0; e < eye_count; ++e)
        for (uint32_t i = 0; i < std::min(slots, slot_capacity); ++i) {
            const uint32_t kind = below(40), x = below(grid.columns), y = below(grid.rows);
            uint32_t x1 = x, y1 = y;
            if (kind < 6)
                continue;
            if (kind == 6) {
                p.places[e * slot_capacity + i] = {floatBits(random.uniform(0.01f, 100)),
                                                   (grid.columns - 1) << 16 | (grid.rows - 1) << 24};
                continue;
            }
            if (kind < 30) {
                x1 = std::min(x + below(3), grid.columns - 1);
                y1 = std::min(y + below(4), grid.rows - 1);
            }
            p.places[e * slot_capacity + i] = {floatBits(std::exp(random.uniform(-1, 5))),
                                               x | y << 8 | x1 << 16 | y1 << 24};
        }
    return p;
}

struct Expected {
    std::vector<std::vector<std::pair<uint32_t, uint32_t>>> cells; // slot, depth; sorted
    std::vector<uint32_t> counts, ends;
    uint32_t pairs[kMaxEyes] = {};

    explicit Expected(const Places& p) : cells(size_t(p.eye_count) * p.grid.cells())
    {
        for (uint32_t e = 0; e < p.eye_count; ++e)
            for (uint32_t i = 0; i < std::min(p.slots[e], p.slot_capacity); ++i) {
                const uint32_t slot = e * p.slot_capacity + i;
                forCells(p.grid, p.slab_of, p.places[slot], [&](uint32_t cell) {
                    cells[size_t(e) * p.grid.cells() + cell].push_back({slot, p.places[slot].depth_bits});
                    ++pairs[e];
                });
            }
        for (auto& cell : cells) {
            std::sort(cell.begin(), cell.end());
            counts.push_back(uint32_t(cell.size()));
            ends.push_back((ends.empty() ? 0u : ends.back()) + counts.back());
        }
    }
    [[nodiscard]] uint32_t startOf(size_t cell) const { return cell == 0 ? 0u : ends[cell - 1]; }
};

// By the keys that 1, 2, 4, 8 and 16 warps hold.
uint32_t classOf(uint32_t keys)
{
    return keys <= 512 ? 0 : keys <= 1024 ? 1 : keys <= 2048 ? 2 : keys <= 4096 ? 3 : keys <= 8192 ? 4 : 5;
}

// Class, first key, number of keys.
using PieceSet = std::set<std::tuple<uint32_t, uint32_t, uint32_t>>;

// Runs of a bin's cells whose starts fall into one multiple of kPieceAim, those of two keys and more.
PieceSet expectedPieces(const Places& p, const Expected& expected, uint32_t pair_capacity)
{
    PieceSet pieces;
    const uint32_t slabs = p.grid.slabs();
    for (size_t first = 0; first < expected.ends.size(); first += slabs) {
        const uint32_t origin = expected.startOf(first);
        for (size_t cell = first; cell < first + slabs;) {
            const uint32_t start = expected.startOf(cell), number = (start - origin) / kPieceAim;
            while (cell < first + slabs && (expected.startOf(cell) - origin) / kPieceAim == number)
                ++cell;
            const uint32_t end = std::min(expected.ends[cell - 1], pair_capacity);
            if (end >= start + 2)
                pieces.insert({classOf(end - start), start, end - start});
        }
    }
    return pieces;
}

void checkQueue(const Places& p, const Expected& expected, const FrameCounters& counters,
                const std::vector<uint32_t>& bin_class, const std::vector<uint32_t>& queue)
{
    const uint32_t slabs = p.grid.slabs(), bins = p.eye_count * p.grid.bins();
    uint32_t wrong = 0, per_class[kBinClasses] = {}, long_bins = 0, longest_bins = 0;
    for (uint32_t bin = 0; bin < bins; ++bin) {
        const uint32_t count = expected.ends[size_t(bin + 1) * slabs - 1] - expected.startOf(size_t(bin) * slabs);
        wrong += bin_class[bin] != uint32_t(std::countl_zero(count));
        ++per_class[std::countl_zero(count)];
        long_bins += count >= kLongList;
        longest_bins += count >= kFirstUnits * kTouchUnit;
    }
    CHECK(wrong == 0);
    CHECK(std::equal(per_class, per_class + kBinClasses, counters.pass.bin_classes));
    CHECK(counters.pass.long_bins == long_bins);
    CHECK(counters.pass.longest_bins == longest_bins);
    std::vector<uint32_t> sorted = queue;
    std::sort(sorted.begin(), sorted.end());
    bool permutation = true, fullest_first = true;
    for (uint32_t i = 0; i < bins; ++i) {
        permutation &= sorted[i] == i;
        fullest_first &=
            i == 0 || queue[i] >= bins || queue[i - 1] >= bins || bin_class[queue[i - 1]] <= bin_class[queue[i]];
    }
    CHECK(permutation);
    CHECK(fullest_first);
}

// Every long list, and no other, has units that follow each other, for each of its readers.
void checkUnits(const Places& p, const Expected& expected, uint32_t pair_capacity, uint32_t readers,
                const FrameCounters& counters, const std::vector<TouchUnit>& units,
                const std::vector<uint32_t>& bin_units)
{
    const uint32_t slabs = p.grid.slabs(), pairs = expected.ends.back();
    std::vector<bool> listed(units.size());
    uint32_t wrong = 0, total = 0;
    for (uint32_t entry = 0; entry < bin_units.size(); ++entry) {
        const uint32_t begin = expected.startOf(size_t(entry) * slabs),
                       end = expected.ends[size_t(entry + 1) * slabs - 1];
        if (pairs > pair_capacity || end - begin < kLongList)
            continue;
        const uint32_t parts = (end - begin + kTouchUnit - 1) / kTouchUnit;
        REQUIRE(bin_units[entry] + parts * readers <= units.size());
        for (uint32_t i = 0; i < parts * readers; ++i, ++total) {
            const TouchUnit& unit = units[bin_units[entry] + i];
            const uint32_t first = begin + i % parts * kTouchUnit;
            wrong += unit.entry != entry || unit.eye != (readers > 1 ? i / parts : entry / p.grid.bins()) ||
                     unit.number != i % parts || unit.first != first ||
                     unit.count != std::min(kTouchUnit, end - first) || listed[bin_units[entry] + i];
            listed[bin_units[entry] + i] = true;
        }
    }
    CHECK(wrong == 0);
    CHECK(counters.pass.touch_units == total);
}

void checkBin(const Places& p, uint32_t pair_capacity, uint32_t readers = 1)
{
    const Expected expected(p);
    const uint32_t bins = p.eye_count * p.grid.bins();
    FrameCounters before{};
    std::copy_n(p.slots, kMaxEyes, before.pass.slots);
    std::copy_n(expected.pairs, kMaxEyes, before.pass.pairs); // the decoder counts them
    before.pairs[0] = 7;                                      // of the passes before
    before.most_pairs = 1;
    const uint32_t piece_capacity = pieceCapacity(bins, pair_capacity);
    const size_t scratch_bytes = binScratchBytes(p.eye_count * p.grid.cells());
    const GuardedBuffer<SplatPlace> places(p.places);
    const GuardedBuffer<uint16_t> slab_of(p.slab_of);
    const GuardedBuffer<uint32_t> cells(expected.counts), bin_class(bins), bin_queue(bins);
    const GuardedBuffer<BinKey> keys(pair_capacity);
    const GuardedBuffer<Piece> pieces(size_t(kPieceClasses) * piece_capacity);
    const GuardedBuffer<unsigned char> scratch(scratch_bytes);
    const GuardedBuffer<uint32_t> bin_units(bins);
    const GuardedBuffer<uint32_t> unfinished(size_t(readers) * bins);
    const GuardedBuffer<TouchUnit> units(touchCapacity(readers, bins, pair_capacity));
    const GuardedBuffer<uint32_t> wide(kWideSplats);
    const GuardedBuffer<FrameCounters> counters(std::vector<FrameCounters>{before});

    BinCudaArgs args{};
    args.grid = p.grid;
    args.lists = p.eye_count;
    args.readers = readers;
    args.bin_units = bin_units.get();
    args.touch_units = units.get();
    args.unfinished = unfinished.get();
    args.places = places.get();
    args.slot_capacity = p.slot_capacity;
    args.pass = {slab_of.get(), kOtherPass, kOtherPass + 1};
    args.cells = cells.get();
    args.keys = keys.get();
    args.pair_capacity = pair_capacity;
    args.wide = wide.get();
    args.bin_class = bin_class.get();
    args.bin_queue = bin_queue.get();
    args.pieces = pieces.get();
    args.piece_capacity = piece_capacity;
    args.scratch = scratch.get();
    args.scratch_bytes = scratch_bytes;
    args.counters = counters.get();
    binCuda(args, kTestProcessors, testStream().handle);
    for (const bool whole : {places.intact(), slab_of.intact(), cells.intact(), bin_class.intact(), bin_queue.intact(),
                             keys.intact(), pieces.intact(), scratch.intact(), counters.intact(), bin_units.intact(),
                             units.intact(), unfinished.intact(), wide.intact()})
        CHECK(whole);

    const FrameCounters after = counters.read()[0];
    const uint32_t total = expected.ends.back();
    CHECK(after.overflow == (total > pair_capacity ? kPairOverflow : 0u));
    CHECK(after.pairs[0] == 7 + expected.pairs[0]);
    CHECK(after.pairs[1] == expected.pairs[1]);
    CHECK(after.most_slots == std::max(p.slots[0], p.slots[1]));
    CHECK(after.most_pairs == std::max(total, 1u)); // what the keys are grown to

    const std::vector<uint32_t> ends = cells.read();
    CHECK(ends == expected.ends);
    CHECK(std::is_sorted(ends.begin(), ends.end()));

    const std::vector<BinKey> found = keys.read();
    uint32_t wrong = 0;
    for (size_t cell = 0; cell < expected.cells.size(); ++cell) {
        std::vector<std::pair<uint32_t, uint32_t>> content;
        for (uint32_t i = expected.startOf(cell); i < std::min(expected.ends[cell], pair_capacity); ++i)
            content.push_back({found[i].slot, found[i].depth_bits});
        std::sort(content.begin(), content.end());
        if (expected.ends[cell] <= pair_capacity)
            wrong += content != expected.cells[cell];
        else // cut by the end of the keys: some of its content, nothing twice
            wrong += !std::includes(expected.cells[cell].begin(), expected.cells[cell].end(), content.begin(),
                                    content.end());
    }
    CHECK(wrong == 0);
    for (uint32_t i = total; i < pair_capacity; ++i)
        if (found[i].slot != ~0u || found[i].depth_bits != ~0u)
            ++wrong;
    CHECK(wrong == 0); // nothing behind the last key

    PieceSet listed;
    uint32_t pieces_total = 0;
    const std::vector<Piece> all = pieces.read();
    for (uint32_t kind = 0; kind < kPieceClasses; ++kind) {
        REQUIRE(after.pass.pieces[kind] <= piece_capacity);
        for (uint32_t i = 0; i < after.pass.pieces[kind]; ++i, ++pieces_total)
            listed.insert(
                {kind, all[size_t(kind) * piece_capacity + i].first, all[size_t(kind) * piece_capacity + i].count});
    }
    CHECK(listed == expectedPieces(p, expected, pair_capacity));
    CHECK(listed.size() == pieces_total);
    const std::vector<uint32_t> none = unfinished.read();
    CHECK(std::count(none.begin(), none.end(), 0u) == std::ptrdiff_t(none.size()));
    checkUnits(p, expected, pair_capacity, readers, after, units.read(), bin_units.read());
    checkQueue(p, expected, after, bin_class.read(), bin_queue.read());
}

void checkWithRoom(const Places& p)
{
    checkBin(p, Expected(p).ends.back() + 5);
}

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
