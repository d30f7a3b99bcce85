// SPDX-License-Identifier: Apache-2.0
// Valid files open; damaged headers and tables do not.
#include "tests/format/mutation.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <bit>
#include <cstddef>
#include <vector>

using namespace gsc;
using namespace gsc::test;

namespace {

std::vector<TinyGscOptions> variants()
{
    std::vector<TinyGscOptions> all(10);
    all[1].levels = 2;
    all[1].level_inputs = true;
    all[2].levels = 3;
    all[2].anchors = 2500;
    all[2].n_offsets = 10;
    all[2].feat_dim = 32;
    all[2].feature_bank = true;
    all[3].float_positions = true;
    all[3].rotation = all[3].opacity = all[3].normal = true;
    all[4].feature_bank = true;
    all[4].appearance_dim = 5;
    all[4].appearance_rows = 17;
    all[5].anchors = 2;
    all[5].nodes = 1;
    all[5].feat_dim = all[5].n_offsets = 1;
    all[5].cameras = 0;
    all[6].anchors = 129;
    all[6].nodes = 1;
    all[7].cell_log2 = kMaxCellLog2;
    all[7].distance_inputs = false;
    all[8].cell_log2 = 0;
    all[8].nodes = 8;
    all[8].anchors = 1024;
    all[9].anchors = 2 * kGroupSize; // no group is short
    all[9].nodes = 1;
    return all;
}

} // namespace

TEST_CASE("valid files of every kind open without a word")
{
    size_t number = 0;
    for (const TinyGscOptions& options : variants()) {
        ++number;
        CAPTURE(number);
        const Bytes file = tinyGsc(options);
        for (const GscCheck level : {GscCheck::Index, GscCheck::Full}) {
            const Verdict verdict = check(file, level);
            CHECK(verdict.good);
            CHECK(verdict.issues.empty());
            for (const Issue& found : verdict.issues)
                MESSAGE(found.info->name << ": " << found.pointer << ": " << found.detail);
        }
        CHECK(tinyGsc(options) == file);
    }
}

TEST_CASE("masked slots are good, even all of an anchor, where the model says that it has them")
{
    Bytes file = tinyGsc();
    float* const offset = payloadArray<float>(file, 1, ChunkArray::Offset);
    std::fill_n(offset, 9, std::bit_cast<float>(kMaskedOffset));      // all three of the first anchor
    std::fill_n(offset + 12, 3, std::bit_cast<float>(kMaskedOffset)); // the second of the second
    reseal(file);
    GscView view;
    CHECK(!openGsc(file, view, GscCheck::Full, nullptr));
    records<ModelParams>(file, kSectionParams)->flags |= kModelMaskedSlots;
    reseal(file);
    CHECK(openGsc(file, view, GscCheck::Full, nullptr));
}

TEST_CASE("the view is what the file holds")
{
    TinyGscOptions options;
    options.levels = 2;
    options.appearance_dim = 3;
    options.appearance_rows = 20;
    Bytes file = tinyGsc(options);
    GscView view;
    REQUIRE(openGsc(file, view, GscCheck::Full, nullptr));
    CHECK(view.header->anchor_count == options.anchors);
    CHECK(view.sections.size() == 13);
    CHECK(view.manifest == options.manifest);
    CHECK(view.params->n_offsets == options.n_offsets);
    CHECK(view.levels.size() == 2);
    CHECK(view.chunks.size() == view.params->chunk_count);
    CHECK(view.groups.size() == view.params->group_count);
    CHECK(view.leaves.size() == view.params->leaf_count);
    CHECK(view.index.size() == options.anchors);
    CHECK(view.mlps.size() == 3);
    CHECK(view.embedding_rows.size() == 20);
    CHECK(view.embedding_rows[19] == 39);
    CHECK(view.embedding.size() == 60);
    CHECK(view.cameras.size() == 2);
    CHECK(view.camera_names == "view_0view_1");
    uint64_t anchors = 0;
    for (const ChunkRecord& chunk : view.chunks) {
        anchors += chunk.anchor_count;
        const auto payload = chunkPayload(view, chunk);
        CHECK(payload.size() == chunkArrayLayout(*view.params, chunk.anchor_count).bytes);
        CHECK(reinterpret_cast<uintptr_t>(payload.data()) - reinterpret_cast<uintptr_t>(file.data()) ==
              sectionEntry(file, kSectionAnchors)->offset + chunk.payload_offset);
    }
    CHECK(anchors == options.anchors);

    GscView summary;
    REQUIRE(openGscSummary(file, summary, nullptr));
    CHECK(summary.params == view.params);
    CHECK(summary.levels.data() == view.levels.data());
    CHECK(summary.manifest == options.manifest);
    CHECK(summary.chunks.empty());
}

TEST_CASE("the summary does not look beyond header, table, META, PARM and LEVL")
{
    Bytes file = tinyGsc();
    for (const uint32_t type : {kSectionAnchors, kSectionChunks, kSectionGroups, kSectionLeaves, kSectionNanoVdb,
                                kSectionIndex, kSectionWeights, kSectionPacked, kSectionCameras})
        for (std::byte& b : section(file, type))
            b = std::byte{0xff};
    GscView view;
    CHECK(openGscSummary(file, view, nullptr));
    CHECK(!openGsc(file, view, GscCheck::Index, nullptr));
}

TEST_CASE("the summary verifies what it shows")
{
    for (const uint32_t type : {kSectionMeta, kSectionParams, kSectionLevels}) {
        CAPTURE(type);
        Bytes file = tinyGsc();
        // one bit, and the value is as good as the one before: a letter, near_z, a bound
        const size_t at = type == kSectionMeta     ? 2
                          : type == kSectionParams ? offsetof(ModelParams, near_z)
                                                   : offsetof(LevelRecord, bounds_min);
        section(file, type)[at] ^= std::byte{1};
        std::vector<uint16_t> ids;
        GscView view;
        CHECK(!openGscSummary(file, view, [&](const Issue& found) { ids.push_back(found.info->id); }));
        CHECK(std::count(ids.begin(), ids.end(), issue::SectionChecksum) == 1);
    }
}

TEST_CASE("every truncation is refused")
{
    const Bytes file = tinyGsc();
    for (size_t size = 0; size < file.size(); size += size < 4096 ? 1 : 64) {
        CAPTURE(size);
        for (const GscCheck level : {GscCheck::Index, GscCheck::Full}) {
            const Verdict verdict = check(std::span(file).first(size), level);
            CHECK(!verdict.good);
            CHECK(verdict.ids == std::set<uint16_t>{issue::Truncated});
        }
    }
}

TEST_CASE("one byte too many is refused")
{
    Bytes file = tinyGsc();
    file.push_back(std::byte{0});
    const Verdict verdict = check(file);
    CHECK(!verdict.good);
    CHECK(verdict.ids == std::set<uint16_t>{issue::TrailingBytes});
}

TEST_CASE("every flipped byte of the header is refused")
{
    using namespace issue;
    const auto allowed = [](size_t at) -> std::set<uint16_t> {
        if (at < 4)
            return {NotGsc, MagicMangled}; // without its high bit the first byte looks like a 7-bit transfer
        if (at < 8)
            return {MagicMangled};
        if (at < offsetof(FileHeader, version_minor))
            return {VersionUnsupported};
        if (at < offsetof(FileHeader, header_bytes))
            return {HeaderChecksum};
        if (at < offsetof(FileHeader, file_bytes))
            return {HeaderBytes};
        if (at < offsetof(FileHeader, section_count))
            return {Truncated, TrailingBytes, HeaderChecksum};
        if (at < offsetof(FileHeader, section_entry_bytes))
            return {SectionTotal, HeaderChecksum};
        if (at < offsetof(FileHeader, section_offset))
            return {SectionEntryBytes};
        if (at < offsetof(FileHeader, anchor_count))
            return {SectionTableOffset};
        return {HeaderChecksum};
    };
    const Bytes file = tinyGsc();
    for (size_t at = 0; at < sizeof(FileHeader); ++at)
        for (const unsigned mask : {0x01u, 0x80u, 0xffu}) {
            CAPTURE(at);
            CAPTURE(mask);
            Bytes copy = file;
            copy[at] ^= std::byte(mask);
            const Verdict verdict = check(copy);
            CHECK(!verdict.good);
            CHECK(!verdict.ids.empty());
            for (const uint16_t id : verdict.ids) {
                CAPTURE(id);
                CHECK(allowed(at).count(id) == 1);
            }
        }
}

TEST_CASE("every flipped byte of the section table is refused")
{
    Bytes file = tinyGsc();
    const size_t end = sizeof(FileHeader) + header(file).section_count * sizeof(SectionEntry);
    for (size_t at = sizeof(FileHeader); at < end; ++at) {
        CAPTURE(at);
        Bytes copy = file;
        copy[at] ^= std::byte{0x10};
        const Verdict verdict = check(copy);
        CHECK(!verdict.good);
        CHECK(verdict.ids == std::set<uint16_t>{issue::HeaderChecksum});
    }
}

TEST_CASE("every flipped byte of the section table is refused even if its checksum is made to fit")
{
    using namespace issue;
    const auto expected = [](size_t field, uint32_t type) -> std::set<uint16_t> {
        if (field < offsetof(SectionEntry, version)) // a camera section under another name is one too many
            return type == kSectionCameras ? std::set<uint16_t>{SectionUnknown} : std::set<uint16_t>{SectionMissing};
        if (field < offsetof(SectionEntry, codec))
            return {SectionVersion};
        if (field < offsetof(SectionEntry, flags))
            return {SectionCodec};
        if (field < offsetof(SectionEntry, reserved))
            return {SectionFlagBits};
        if (field < offsetof(SectionEntry, offset))
            return {SectionReserved};
        if (field < offsetof(SectionEntry, bytes))
            return {SectionAlignment, SectionRange, SectionOverlap};
        if (field < offsetof(SectionEntry, checksum))
            return {SectionRange,    SectionOverlap,    SectionGap,   SectionBytes,
                    SectionChecksum, ChunkPayloadRange, AnchorsBytes, Truncated};
        if (field < offsetof(SectionEntry, count))
            return {SectionChecksum};
        return {SectionCount, SectionBytes};
    };
    Bytes file = tinyGsc();
    const std::vector<TinySection> sections = takeApart(file);
    for (size_t i = 0; i < sections.size(); ++i)
        for (size_t field = 0; field < sizeof(SectionEntry); ++field) {
            CAPTURE(i);
            CAPTURE(field);
            Bytes copy = file;
            copy[sizeof(FileHeader) + i * sizeof(SectionEntry) + field] ^= std::byte{0xff};
            resealHeader(copy);
            const Verdict verdict = check(copy);
            CHECK(!verdict.good);
            bool found = false;
            for (const uint16_t id : expected(field, sections[i].entry.type))
                found |= verdict.ids.count(id) == 1;
            CHECK(found);
        }
}

TEST_CASE("every flipped bit of a valid file is noticed")
{
    TinyGscOptions options;
    options.anchors = 40;
    const Bytes file = tinyGsc(options);
    // all bits of the first pages, then a sample that visits every 17th byte
    for (size_t at = 0; at < file.size(); at += at < 4096 ? 1 : 17) {
        CAPTURE(at);
        Bytes copy = file;
        copy[at] ^= std::byte(1u << at % 8);
        CHECK(!check(copy).good);
    }
}

TEST_CASE("a future version is refused, a newer minor version is not")
{
    for (const uint16_t major : {uint16_t(0), uint16_t(2), uint16_t(0xffff)}) {
        Bytes file = tinyGsc();
        header(file).version_major = major;
        reseal(file);
        const Verdict verdict = check(file);
        CHECK(!verdict.good);
        CHECK(verdict.ids == std::set<uint16_t>{issue::VersionUnsupported});
    }
    Bytes file = tinyGsc();
    header(file).version_minor = 9;
    reseal(file);
    CHECK(check(file).good);
    CHECK(check(file).issues.empty());
}
