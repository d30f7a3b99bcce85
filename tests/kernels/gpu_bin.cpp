// SPDX-License-Identifier: Apache-2.0
#include "tests/kernels/gpu_bin.h"

#include <doctest/doctest.h>

#include <bit>
#include <map>
#include <set>
#include <tuple>

namespace gsc::test {

namespace {

constexpr uint32_t kOtherPass = 5; // slabs are numbered over all passes: only their low bits name a cell

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

} // namespace

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

void checkBin(const Places& p, uint32_t pair_capacity, uint32_t readers)
{
    const Expected expected(p);
    const uint32_t bins = p.eye_count * p.grid.bins();
    FrameCounters before{};
    std::copy_n(p.slots, kMaxEyes, before.pass.slots);
    std::copy_n(expected.pairs, kMaxEyes, before.pass.pairs); // the decoder counts them
    before.pairs[0] = 7;                                      // pairs of the passes before
    before.most_pairs = 1;
    const uint32_t piece_capacity = pieceCapacity(bins, pair_capacity);
    const size_t scratch_bytes = binScratchBytes(p.eye_count * p.grid.cells());
    const GuardedBuffer<SplatPlace> places(p.places);
    const GuardedBuffer<uint16_t> slab_of(p.slab_of);
    const GuardedBuffer<uint32_t> cells(expected.counts), bin_class(bins), bin_queue(bins);
    const GuardedBuffer<SortKey> keys(pair_capacity);
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
    CHECK(after.most_pairs == std::max(total, 1u)); // number that the keys grow to

    const std::vector<uint32_t> ends = cells.read();
    CHECK(ends == expected.ends);
    CHECK(std::is_sorted(ends.begin(), ends.end()));

    const std::vector<SortKey> found = keys.read();
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

} // namespace gsc::test
