// SPDX-License-Identifier: Apache-2.0
// Pieces of every class sorted on the device: by depth, then by emission order, and nothing beside them touched.
#include "kernels/decode/exact/decode_exact_cuda.h"
#include "kernels/sort/sort_cuda.h"
#include "tests/kernels/gpu_stage.h"

#include <doctest/doctest.h>

#include <functional>

using namespace gsc;
using namespace gsc::test;

namespace {

using DepthOf = std::function<uint32_t(uint32_t i, Random& random)>;

struct Pattern {
    const char* name;
    DepthOf depth;
};

uint32_t bits(Random& random, uint32_t count)
{
    return uint32_t(random.uniform() * float(1u << count));
}

const Pattern kPatterns[] = {
    {"random", [](uint32_t, Random& random) { return floatBits(std::exp(random.uniform(-1, 9))); }},
    {"ties", [](uint32_t, Random& random) { return floatBits(1.0f + float(bits(random, 6))); }},
    {"last bits", [](uint32_t, Random& random) { return 0x40490f00u + bits(random, 8); }},
    {"whole range",
     [](uint32_t i, Random& random) {
         const uint32_t edges[4] = {0u, 1u, 0x7f7fffffu, 0x00800000u};
         return i % 16 < 4 ? edges[i % 4] : bits(random, 15) << 16 | bits(random, 16);
     }},
    {"descending", [](uint32_t i, Random&) { return 0x7f000000u - 3 * i; }},
    {"sorted", [](uint32_t i, Random&) { return 0x40000000u + i / 2; }},
};
const Pattern kEqual = {"equal", [](uint32_t, Random&) { return 0x41200000u; }};

template <typename Splat>
void checkSort(const std::vector<uint32_t>& counts, const Pattern& pattern, uint32_t seed)
{
    CAPTURE(pattern.name);
    CAPTURE(sizeof(Splat));
    constexpr uint32_t kGap = 3;     // keys between two pieces
    constexpr SortKey kGapKey{0, 1}; // nearer than any, should it be compared
    Random random(seed);
    uint32_t total = kGap;
    for (const uint32_t count : counts)
        total += count + kGap;

    // slots and emission orders are two permutations: neither follows the keys
    std::vector<uint32_t> slots(total), ranks(total);
    for (uint32_t i = 0; i < total; ++i)
        slots[i] = ranks[i] = i;
    const auto shuffle = [&random](std::vector<uint32_t>& values) {
        for (size_t i = values.size(); i > 1; --i)
            std::swap(values[i - 1], values[size_t(random.uniform() * float(i))]);
    };
    shuffle(slots);
    shuffle(ranks);
    std::vector<Splat> splats(total);
    std::memset(static_cast<void*>(splats.data()), 0xff, total * sizeof(Splat));
    for (uint32_t i = 0; i < total; ++i)
        splats[i].order = ranks[i] * 3;

    const auto piece_capacity = uint32_t(counts.size());
    std::vector<SortKey> keys(total, kGapKey);
    std::vector<Piece> pieces(size_t(kPieceClasses) * piece_capacity, Piece{~0u, ~0u});
    FrameCounters before{};
    std::vector<Piece> listed;
    uint32_t at = kGap;
    for (const uint32_t count : counts) {
        const uint32_t kind = pieceClass(count);
        listed.push_back({at, count});
        pieces[size_t(kind) * piece_capacity + before.pass.pieces[kind]++] = listed.back();
        for (uint32_t i = 0; i < count; ++i)
            keys[at + i] = {pattern.depth(i, random), slots[at + i]};
        at += count + kGap;
    }

    const GuardedBuffer<SortKey> device_keys(keys);
    const GuardedBuffer<Splat> device_splats(splats);
    const GuardedBuffer<Piece> device_pieces(pieces);
    const GuardedBuffer<FrameCounters> counters(std::vector<FrameCounters>{before});
    sortCuda({device_keys.get(), &device_splats.get()->order, std::is_same_v<Splat, ExactSplat>, device_pieces.get(),
              piece_capacity, counters.get()},
             kTestProcessors, testStream().handle);
    CHECK(device_keys.intact());
    CHECK(device_splats.intact());
    CHECK(device_pieces.intact());
    CHECK(counters.intact());

    const std::vector<SortKey> sorted = device_keys.read();
    std::vector<SortKey> expected = keys;
    std::vector<bool> inside(total, false);
    for (const Piece& piece : listed) {
        std::sort(expected.begin() + piece.first, expected.begin() + piece.first + piece.count,
                  [&splats](const SortKey& a, const SortKey& b) {
                      return a.depth_bits != b.depth_bits ? a.depth_bits < b.depth_bits
                                                          : splats[a.slot].order < splats[b.slot].order;
                  });
        uint32_t wrong = 0;
        for (uint32_t i = piece.first; i < piece.first + piece.count; ++i) {
            wrong += sorted[i].slot != expected[i].slot; // the depth means nothing afterwards
            inside[i] = true;
        }
        CAPTURE(piece.count);
        CHECK(wrong == 0);
    }
    bool untouched = true;
    for (uint32_t i = 0; i < total; ++i)
        untouched &= inside[i] || (sorted[i].slot == kGapKey.slot && sorted[i].depth_bits == kGapKey.depth_bits);
    CHECK(untouched);
}

} // namespace

TEST_CASE("sort: pieces around the edges of every class, several of each, any depths")
{
    uint32_t seed = 1;
    for (const Pattern& pattern : kPatterns) {
        const std::vector<uint32_t> warps = {2, 3, 31, 32, 33, 64, 127, 128, 129, 511, 512};
        const std::vector<uint32_t> blocks = {513, 514, 1024, 2047, 2048, 2049, 8191, 8192};
        checkSort<PackedSplat>(warps, pattern, seed++);
        checkSort<ExactSplat>(warps, pattern, seed++);
        checkSort<PackedSplat>(blocks, pattern, seed++);
        checkSort<ExactSplat>(blocks, pattern, seed++);
    }
}

TEST_CASE("sort: more keys than a block holds")
{
    for (const Pattern& pattern : kPatterns) {
        checkSort<PackedSplat>({8193, 17000}, pattern, 5);
        checkSort<ExactSplat>({8194, 16384}, pattern, 6);
    }
    checkSort<PackedSplat>({8193, 17000}, kEqual, 7);
    checkSort<ExactSplat>({9001}, kEqual, 8);
}

TEST_CASE("trap 28: sort of equal depths is the emission order, whatever the length")
{
    checkSort<PackedSplat>({2, 31, 33, 34, 128, 129, 512, 513, 2048, 2049}, kEqual, 11);
    checkSort<ExactSplat>({2, 31, 33, 128, 129, 513, 2049}, kEqual, 12);
}

TEST_CASE("sort: more pieces of a class than blocks and warps of the launch, and none at all")
{
    Random random(3);
    std::vector<uint32_t> many;
    for (uint32_t i = 0; i < 150; ++i)
        many.push_back(2 + uint32_t(random.uniform() * 40));
    for (uint32_t i = 0; i < 24; ++i)
        many.push_back(513 + uint32_t(random.uniform() * 200));
    for (uint32_t i = 0; i < 6; ++i)
        many.push_back(2049 + uint32_t(random.uniform() * 300));
    for (uint32_t i = 0; i < 3; ++i)
        many.push_back(8193);
    checkSort<PackedSplat>(many, kPatterns[0], 21);
    checkSort<ExactSplat>(many, kPatterns[1], 22);
    checkSort<PackedSplat>({}, kPatterns[0], 23);
}
