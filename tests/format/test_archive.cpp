// SPDX-License-Identifier: Apache-2.0
// Archives give back what they were given, and what is not one is refused before it costs anything.
#include "tests/format/tiny_archive.h"

#include "format/archive/archive.h"
#include "format/archive/ordered_positions.h"
#include <gsc/checksum.h>
#include <gsc/error.h>
#include <gsc/gsc_file.h>
#include <gsc/gsc_issues.h>
#include "tests/support/temporary_folder.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cstring>
#include <fstream>
#include <functional>
#include <random>
#include <set>

using namespace gsc;
using namespace gsc::test;

namespace {

using Bytes = std::vector<std::byte>;

std::vector<TinyGscOptions> variants()
{
    std::vector<TinyGscOptions> all(7);
    all[1].levels = 3;
    all[1].level_inputs = all[1].feature_bank = true;
    all[1].anchors = 2500;
    all[2].float_positions = true;
    all[2].rotation = all[2].opacity = all[2].normal = true;
    all[3].appearance_dim = 5;
    all[3].appearance_rows = 17;
    all[3].sensitivity = true;
    all[4].anchors = 2;
    all[4].nodes = 1;
    all[4].cameras = 0;
    all[5].cell_log2 = kMaxCellLog2;
    all[6].cell_log2 = 0;
    all[6].nodes = 8;
    all[6].anchors = 1024;
    return all;
}

struct Decoded {
    bool good = false;
    Bytes bytes;
    std::set<uint16_t> ids;
    bool unsupported = true; // each issue says so
};

// From memory of its exact size, so that a sanitizer sees a byte too many.
Decoded decode(std::span<const std::byte> bytes, int threads = 2)
{
    const HeapCopy copy(bytes);
    Decoded result;
    const IssueSink sink = [&](const Issue& issue) {
        result.ids.insert(issue.info->id);
        result.unsupported = result.unsupported && isUnsupported(*issue.info);
        CHECK(!issue.detail.empty());
    };
    const Archive archive(copy.bytes(), sink);
    if (!archive.isSound())
        return result;
    REQUIRE(archive.rawBytes() < (64u << 20));
    const AlignedRoom room(archive.rawBytes());
    const std::span<std::byte> out = room.bytes();
    result.good = archive.decode(out, Archive::Scope::All, threads, sink);
    result.bytes.assign(out.begin(), out.end());
    return result;
}

// Issues that a changed archive is found to have, after its checksums were made right again.
std::set<uint16_t> found(const Bytes& archive, const std::function<void(Bytes&)>& change)
{
    Bytes bytes = archive;
    change(bytes);
    resealArchive(bytes);
    const Decoded decoded = decode(bytes);
    CHECK(!decoded.good);
    return decoded.ids;
}

ArchivePart& partOf(std::span<std::byte> archive, uint32_t type)
{
    const std::span<ArchivePart> parts = archiveParts(archive);
    return *std::ranges::find(parts, type, &ArchivePart::type);
}

// The first stream of a part; parts are not aligned.
void changeStream(std::span<std::byte> archive, uint32_t type, const std::function<void(ArchiveStream&)>& change)
{
    std::byte* const at = storedPart(archive, partOf(archive, type)).data();
    ArchiveStream stream;
    std::memcpy(&stream, at, sizeof(stream));
    change(stream);
    std::memcpy(at, &stream, sizeof(stream));
}

} // namespace

TEST_CASE("an archive of every kind of file gives its bytes back")
{
    const TemporaryFolder folder;
    size_t number = 0;
    for (const TinyGscOptions& options : variants()) {
        CAPTURE(++number);
        const Bytes file = tinyGsc(options);
        const Bytes archive = archiveOf(file, folder.path().string());
        CHECK(isArchive(archive));
        CHECK(!isArchive(file));
        CHECK(archive.size() < file.size());
        const Decoded decoded = decode(archive);
        CHECK(decoded.good);
        CHECK(decoded.ids.empty());
        CHECK(decoded.bytes == file);
        CHECK(archiveOf(file, folder.path().string(), 1) == archive);
    }
}

TEST_CASE("what a bake does not write is kept too")
{
    const TemporaryFolder folder;
    Bytes file = tinyGsc();
    // two anchors that change places, bytes between arrays, an index that is none: the index check lets them pass
    std::swap(payloadArray<uint32_t>(file, 0, ChunkArray::SourceIndex)[0],
              payloadArray<uint32_t>(file, 0, ChunkArray::SourceIndex)[1]);
    payloadArray<uint32_t>(file, 1, ChunkArray::SourceIndex)[0] = 0xffffffff;
    reinterpret_cast<std::byte*>(payloadArray<uint32_t>(file, 2, ChunkArray::SourceIndex))[-1] = std::byte{7};
    reseal(file);
    const Decoded decoded = decode(archiveOf(file, folder.path().string()));
    CHECK(decoded.good);
    CHECK(decoded.bytes == file);
}

TEST_CASE("a chunk that is stored raw is still in the index")
{
    const TemporaryFolder folder;
    for (const bool floats : {false, true}) {
        TinyGscOptions options;
        options.float_positions = floats;
        Bytes file = tinyGsc(options);
        reinterpret_cast<std::byte*>(payloadArray<float>(file, 0, ChunkArray::Scale))[-1] = std::byte{7}; // padding
        reseal(file);
        Bytes archive = archiveOf(file, folder.path().string());
        CHECK(partOf(archive, kSectionIndex).bytes == sizeof(ArchiveStream)); // nothing but its record
        const Decoded decoded = decode(archive);
        CHECK(decoded.good);
        CHECK(decoded.bytes == file);
    }
}

TEST_CASE("a file of either profile opens the same")
{
    const TemporaryFolder folder;
    const Bytes file = tinyGsc();
    archiveOf(file, folder.path().string());
    const std::string path = folder / "tiny_archive.gsc";
    const GscFile all(path, throwFirstIssue(path));
    CHECK(all.isArchive());
    CHECK(std::ranges::equal(all.bytes(), file));
    CHECK(all.storedBytes() == std::filesystem::file_size(path));
    const GscFile summary(path, throwFirstIssue(path), GscFile::Read::Summary);
    GscView view;
    CHECK(openGscSummary(summary.bytes(), view, nullptr));
    CHECK(view.params->n_offsets == 3);
    std::ofstream(folder / "plain.gsc", std::ios::binary)
        .write(reinterpret_cast<const char*>(file.data()), std::streamsize(file.size()));
    const GscFile plain(folder / "plain.gsc", throwFirstIssue("plain"));
    CHECK(!plain.isArchive());
    CHECK(std::ranges::equal(plain.bytes(), file));
    for (const GscFile* opened : {&all, &plain}) { // bytes that are let go are there when they are read again
        opened->letGo(opened->bytes());
        opened->letGo(opened->bytes().subspan(5000, 100));
        CHECK(std::ranges::equal(opened->bytes(), file));
    }
}

TEST_CASE("positions of many anchors in few cells keep their order")
{
    std::mt19937 random(3);
    for (const uint32_t cell_log2 : {0u, 2u, 9u}) {
        CAPTURE(cell_log2);
        struct Anchor {
            GridPosition position;
            uint32_t source;
        };
        std::vector<Anchor> anchors(3000);
        for (size_t i = 0; i < anchors.size(); ++i) {
            for (uint16_t& local : anchors[i].position.local)
                local = uint16_t(random() % 24);
            anchors[i].position.flags = uint16_t(random() % 8);
            anchors[i].source = uint32_t(i * 7919 % 3001);
        }
        std::ranges::sort(anchors, {}, [&](const Anchor& a) {
            return std::pair(positionKey(a.position.local) >> 3 * cell_log2, a.source);
        });
        std::vector<GridPosition> positions;
        std::vector<uint32_t> sources;
        for (const Anchor& anchor : anchors) {
            positions.push_back(anchor.position);
            sources.push_back(anchor.source);
        }
        OrderedPositions ordered;
        REQUIRE(orderPositions(positions, sources, cell_log2, ordered));
        CHECK(std::ranges::is_sorted(ordered.keys));
        std::vector<GridPosition> back(positions.size());
        std::vector<uint32_t> sources_back(sources.size());
        restorePositions(ordered, cell_log2, back, sources_back);
        CHECK(std::memcmp(back.data(), positions.data(), back.size() * sizeof(GridPosition)) == 0);
        CHECK(sources_back == sources);
        std::swap(positions.front(), positions.back());
        std::swap(sources.front(), sources.back());
        CHECK(!orderPositions(positions, sources, cell_log2, ordered));
    }
}

TEST_CASE("planes are joined to what was split")
{
    std::mt19937 random(5);
    for (const uint32_t element : {1u, 2u, 4u, 8u})
        for (const uint32_t columns : {1u, 3u, 32u}) {
            Bytes raw(size_t(element) * columns * 777), planes(raw.size()), back(raw.size());
            for (std::byte& b : raw)
                b = std::byte(random());
            splitPlanes(raw, element, columns, planes.data());
            joinPlanes(planes.data(), element, columns, back);
            CHECK(back == raw);
            CHECK(planes[1] == raw[size_t(element) * columns]); // the second record's lowest byte
        }
}

TEST_CASE("no changed byte of an archive passes")
{
    const TemporaryFolder folder;
    TinyGscOptions small;
    small.anchors = 60;
    const Bytes file = tinyGsc(small);
    const Bytes archive = archiveOf(file, folder.path().string());
    for (size_t at = 0; at < archive.size(); at += 13) {
        Bytes bytes = archive;
        bytes[at] ^= std::byte{0x10};
        CAPTURE(at);
        CHECK(!decode(bytes, 1).good);
    }
    for (size_t size = 0; size < archive.size(); size += 509)
        CHECK(!decode(std::span(archive).first(size), 1).good);
}

TEST_CASE("what an archive claims is checked before anything is taken")
{
    using namespace issue;
    using Ids = std::set<uint16_t>;
    const TemporaryFolder folder;
    const Bytes a = archiveOf(tinyGsc(), folder.path().string());
    const auto edit = [&](uint32_t type, const std::function<void(ArchivePart&)>& change) {
        return found(a, [&](Bytes& b) { change(partOf(b, type)); });
    };
    const auto editStream = [&](uint32_t type, const std::function<void(ArchiveStream&)>& change) {
        return found(a, [&](Bytes& b) { changeStream(b, type, change); });
    };

    CHECK(found(a, [](Bytes& b) { ++archiveHeader(b).part_count; }) == Ids{ArchiveList});
    CHECK(found(a, [](Bytes& b) { archiveHeader(b).part_count = 0xffffffff; }) == Ids{ArchiveList});
    CHECK(found(a, [](Bytes& b) { archiveHeader(b).reserved[5] = 1; }) == Ids{ArchiveReserved});
    CHECK(found(a, [](Bytes& b) { archiveHeader(b).raw_bytes += 1; }) == Ids{ArchiveRawBytes});
    CHECK(found(a, [](Bytes& b) { archiveHeader(b).raw_bytes += uint64_t(1) << 50; }) == Ids{ArchiveRawBytes});
    CHECK(edit(kSectionGroups, [](ArchivePart& p) { ++p.offset; }) == Ids{ArchivePartRange});
    CHECK(edit(kSectionGroups, [](ArchivePart& p) { p.bytes = ~uint64_t(0); }) == Ids{ArchivePartRange});
    CHECK(edit(kSectionGroups, [](ArchivePart& p) { --p.raw_offset; }) == Ids{ArchivePartRaw});
    CHECK(edit(kSectionGroups, [](ArchivePart& p) { p.raw_offset = 0; }) == Ids{ArchivePartRaw});
    CHECK(edit(kSectionGroups, [](ArchivePart& p) { p.raw_bytes = ~uint64_t(0); }) == Ids{ArchivePartRaw});
    CHECK(edit(kSectionGroups, [](ArchivePart& p) { p.type = kArchiveFront; }) == Ids{ArchiveFront});
    CHECK(edit(kArchiveFront, [](ArchivePart& p) { p.type = kSectionMeta; }) == Ids{ArchiveFront});
    CHECK(edit(kSectionGroups, [](ArchivePart& p) { p.type = kSectionMeta; }) == Ids{ArchiveFront});
    // a part, and the file with it, of 64 GiB from its few bytes
    CHECK(found(a, [](Bytes& b) {
              ArchivePart& last = archiveParts(b).back();
              last.raw_bytes = uint64_t(1) << 36;
              archiveHeader(b).raw_bytes = alignUp(last.raw_offset + last.raw_bytes, kSectionAlign);
          }) == Ids{ArchiveExpansion});
    CHECK(edit(kSectionGroups, [](ArchivePart& p) { p.stream_count = 0; }) == Ids{ArchiveUndecodable});
    CHECK(edit(kSectionGroups, [](ArchivePart& p) { p.stream_count = 0xffffffff; }) == Ids{ArchiveUndecodable});
    CHECK(edit(kSectionGroups, [](ArchivePart& p) { ++p.raw_checksum; }) == Ids{ArchiveContent});
    CHECK(edit(kSectionIndex, [](ArchivePart& p) { ++p.raw_checksum; }) == Ids{ArchiveContent});
    CHECK(edit(kSectionAnchors, [](ArchivePart& p) { ++p.first_anchor; }) == Ids{ArchiveContent});
    CHECK(editStream(kSectionGroups, [](ArchiveStream& s) { s.codec = 17; }) == Ids{ArchiveCodecUnknown});
    CHECK(editStream(kSectionGroups, [](ArchiveStream& s) { s.codec = uint16_t(Codec::Inverse); }) ==
          Ids{ArchiveUndecodable});
    CHECK(editStream(kSectionGroups, [](ArchiveStream& s) { s.element = 3; }) == Ids{ArchiveUndecodable});
    CHECK(editStream(kSectionGroups, [](ArchiveStream& s) { s.columns = 0; }) == Ids{ArchiveUndecodable});
    CHECK(editStream(kSectionGroups, [](ArchiveStream& s) { s.raw_offset = ~uint64_t(0); }) == Ids{ArchiveUndecodable});
    CHECK(editStream(kSectionGroups, [](ArchiveStream& s) { s.raw_bytes = ~uint64_t(0) - 3; }) ==
          Ids{ArchiveUndecodable});
    CHECK(editStream(kSectionGroups, [](ArchiveStream& s) { s.bytes = ~uint64_t(0); }) == Ids{ArchiveUndecodable});
    CHECK(editStream(kSectionAnchors, [](ArchiveStream& s) { s.cell_log2 = 60; }) == Ids{ArchiveUndecodable});
    CHECK(editStream(kSectionAnchors, [](ArchiveStream& s) { s.columns = 0xffffffff; }) == Ids{ArchiveUndecodable});
    CHECK(editStream(kSectionAnchors, [](ArchiveStream& s) { ++s.sources; }) == Ids{ArchiveUndecodable});
    CHECK(found(a,
                [](Bytes& b) { // a byte of a frame
                    const std::span<std::byte> stored = storedPart(b, partOf(b, kSectionGroups));
                    stored[sizeof(ArchiveStream) + 2] ^= std::byte{0xff};
                })
              .size() == 1);
    CHECK(found(a, [](Bytes& b) { // sizes of the ordered positions that wrap
              std::byte* const pieces = storedPart(b, partOf(b, kSectionAnchors)).data() +
                                        partOf(b, kSectionAnchors).stream_count * sizeof(ArchiveStream);
              const OrderedHeader wrong{~uint64_t(0), 1, 1};
              std::memcpy(pieces, &wrong, sizeof(wrong));
          }) == Ids{ArchiveUndecodable});

    Bytes unread = a; // a checksum alone
    storedPart(unread, partOf(unread, kSectionGroups)).back() ^= std::byte{1};
    CHECK(decode(unread).ids == Ids{ArchiveChecksum});
    Bytes unknown = a;
    changeStream(unknown, kSectionGroups, [](ArchiveStream& s) { s.codec = 99; });
    resealArchive(unknown);
    CHECK(decode(unknown).ids == Ids{ArchiveCodecUnknown});
    CHECK(decode(unknown).unsupported);
    Bytes data = a; // the checksum of the whole
    ++sectionEntry(data, kSectionData)->checksum;
    header(data).header_checksum = 0;
    header(data).header_checksum = checksum64(std::span(data).first(sizeof(FileHeader) + 2 * sizeof(SectionEntry)));
    CHECK(decode(data).ids == Ids{SectionChecksum});
    CHECK(isUnsupported(issueInfo(ArchiveCodecMissing)));
    CHECK(!hasCodec(Codec(99)));
}
