// SPDX-License-Identifier: Apache-2.0
// The codec of values on power-of-two steps: what it takes comes back bit for bit, what it does not take it leaves alone, and
// no stored byte is trusted.
#include "tests/support/temporary_folder.h"
#include "tests/format/tiny_archive.h"

#include "format/archive/archive.h"
#include "format/archive/steps.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <random>

using namespace gsc;
using namespace gsc::test;

namespace {

using Bytes = std::vector<std::byte>;

struct Table {
    uint32_t columns, span;
    bool masks;
    std::vector<float> values;

    [[nodiscard]] std::span<const std::byte> bytes() const { return std::as_bytes(std::span(values)); }
};

// Records whose spans have steps from 2^-20 to 2^6; some are zero, some masked.
Table randomTable(uint32_t columns, uint32_t span, bool masks, size_t records, uint32_t seed)
{
    std::mt19937 random(seed);
    Table table{columns, span, masks, std::vector<float>(records * columns)};
    for (size_t first = 0; first < table.values.size(); first += span) {
        const int exponent = int(random() % 27) - 20, spread = 1 << random() % 14;
        const bool zero = random() % 9 == 0;
        for (size_t i = first; i < first + span; ++i)
            table.values[i] =
                zero ? 0.0f : std::ldexp(float(int(random() % (2 * uint32_t(spread))) - spread), exponent);
    }
    for (size_t i = 0; masks && i < table.values.size(); i += 3)
        if (random() % 4 == 0)
            std::fill_n(table.values.begin() + ptrdiff_t(i), 3, std::bit_cast<float>(kMaskedOffset));
    return table;
}

bool encode(const Table& table, Bytes& stored)
{
    Coder coder(3);
    return encodeSteps(table.bytes(), table.columns, table.span, table.masks, coder, stored);
}

// From memory of its exact size, so that a sanitizer sees a byte too many.
bool decode(std::span<const std::byte> stored, const Table& table, Bytes& out)
{
    const HeapCopy copy(stored);
    Coder coder;
    out.assign(table.values.size() * sizeof(float), std::byte{0});
    return decodeSteps(copy.bytes(), table.columns, coder, out);
}

} // namespace

TEST_CASE("values on steps come back bit for bit, in fewer bytes")
{
    uint32_t seed = 1;
    for (const uint32_t columns : {3u, 6u, 30u, 32u})
        for (const uint32_t span : {columns, columns % 3 == 0 ? 3u : 8u})
            for (const bool masks : {false, true})
                for (const size_t records : {size_t(1), size_t(3000)}) {
                    if (masks && columns % 3 != 0)
                        continue;
                    CAPTURE(columns);
                    CAPTURE(span);
                    CAPTURE(masks);
                    const Table table = randomTable(columns, span, masks, records, ++seed);
                    Bytes stored, out;
                    REQUIRE(encode(table, stored));
                    REQUIRE(decode(stored, table, out));
                    CHECK(std::ranges::equal(out, table.bytes()));
                    CHECK((records == 1 || stored.size() < out.size() * 2 / 3));
                }
}

TEST_CASE("values without small steps are not taken, and nothing is appended")
{
    Table table = randomTable(6, 3, true, 1000, 7);
    for (const float odd : {-0.0f, INFINITY, NAN, 1e-40f, 1.0f / 3, 3e38f}) {
        CAPTURE(odd);
        Table changed = table;
        changed.values[5000] = odd; // in a span of coarser values, whose masks cover three
        changed.values[5001] = 64;
        Bytes stored(3);
        CHECK(!encode(changed, stored));
        CHECK(stored.size() == 3);
    }
    std::mt19937 random(3);
    for (float& v : table.values)
        v = std::uniform_real_distribution<float>(-1, 1)(random);
    Bytes stored;
    CHECK(!encode(table, stored));
}

TEST_CASE("no stored byte of steps is trusted")
{
    const Table table = randomTable(6, 3, true, 50, 5);
    Bytes stored, out;
    REQUIRE(encode(table, stored));
    for (size_t size = 0; size < stored.size(); ++size)
        CHECK(!decode(std::span(stored).first(size), table, out));
    Bytes longer = stored;
    longer.push_back(std::byte{0});
    CHECK(!decode(longer, table, out));
    std::mt19937 random(9);
    for (size_t at = 0; at < stored.size(); ++at)
        for (int round = 0; round < 4; ++round) { // decodes to something, or to nothing
            Bytes changed = stored;
            changed[at] = std::byte(random());
            (void)decode(changed, table, out);
        }
    const auto refused = [&](auto&& change) {
        Bytes changed = stored;
        StepsHeader header;
        std::memcpy(&header, changed.data(), sizeof(header));
        change(header);
        std::memcpy(changed.data(), &header, sizeof(header));
        return !decode(changed, table, out);
    };
    CHECK(refused([](StepsHeader& h) { h.span = 0; }));
    CHECK(refused([](StepsHeader& h) { h.span = 4; }));
    CHECK(refused([](StepsHeader& h) { h.span = 0xffffffff; }));
    CHECK(refused([](StepsHeader& h) { h.masks = 2; }));
    CHECK(refused([](StepsHeader& h) { h.planes = 9; }));
    CHECK(refused([](StepsHeader& h) { h.reserved = 1; }));
    CHECK(refused([](StepsHeader& h) { h.exponent_bytes = ~uint64_t(0); }));
    CHECK(refused([](StepsHeader& h) { h.plane_bytes[0] = ~uint64_t(0) - 8; }));
    CHECK(refused([](StepsHeader& h) { h.plane_bytes[2] += 1; }));
}

TEST_CASE("steps below the least normal number are refused")
{
    const Table table{1, 1, false, {3}};
    Bytes stored, out;
    REQUIRE(encode(table, stored));
    const auto decoded = [&](int exponent) { // exponent of the one span, stored as it is
        Bytes changed = stored;
        changed[sizeof(StepsHeader)] = std::byte(exponent);
        return decode(changed, table, out);
    };
    REQUIRE(decoded(-126));
    float value = 0;
    std::memcpy(&value, out.data(), sizeof(value));
    CHECK(value == std::ldexp(3.0f, -126));
    CHECK_FALSE(decoded(-127));
}

TEST_CASE("an archive takes steps where they are smaller, and gives masked slots back")
{
    const TemporaryFolder folder;
    TinyGscOptions options;
    options.anchors = 2000;
    const Bytes file = tinyStepsGsc(options);
    Bytes archive = archiveOf(file, folder.path().string());
    size_t steps = 0;
    for (const ArchivePart& part : archiveParts(archive))
        for (uint32_t i = 0; i < part.stream_count; ++i) {
            ArchiveStream stream;
            std::memcpy(&stream, storedPart(archive, part).data() + i * sizeof(stream), sizeof(stream));
            steps += stream.codec == uint16_t(Codec::Steps);
        }
    CHECK(steps >= 2 * options.nodes); // offsets and features of every chunk
    const Archive opened(archive, nullptr);
    REQUIRE(opened.isSound());
    const AlignedRoom room(opened.rawBytes());
    REQUIRE(opened.decode(room.bytes(), Archive::Scope::All, 2, nullptr));
    CHECK(std::ranges::equal(room.bytes(), file));
}
