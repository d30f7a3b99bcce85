// SPDX-License-Identifier: Apache-2.0
// 1xxx and 2xxx: header and section table.
#include "tests/format/mutation.h"

#include <algorithm>

namespace gsc::test {

namespace {

TinySection foreign(uint32_t flags)
{
    TinySection s{};
    s.entry.type = fourCc("XYZW");
    s.entry.version = 7;
    s.entry.codec = 9;
    s.entry.flags = flags;
    s.content.resize(100, std::byte{0x5a});
    return s;
}

void replaceMagic(Bytes& file, std::initializer_list<unsigned> magic)
{
    std::transform(magic.begin(), magic.end(), file.begin(), [](unsigned v) { return std::byte(v); });
}

} // namespace

std::vector<Mutation> tableMutations()
{
    using namespace issue;
    TinyGscOptions no_cameras;
    no_cameras.cameras = 0;
    return {
        {NotGsc,
         [](Bytes& f) {
             replaceMagic(f, {'p', 'l', 'y', '\n'});
         }},
        // texts that begin as a mangled file does, and go on otherwise
        {NotGsc,
         [](Bytes& f) {
             replaceMagic(f, {0xef, 0xbf, 0xbd, 'I', 'S'});
         }},
        {NotGsc,
         [](Bytes& f) {
             replaceMagic(f, {0xc2, 0x89, 'G', 'o'});
         }},
        {NotGsc,
         [](Bytes& f) {
             replaceMagic(f, {'9', 'G', 'S', 'C'});
         }},
        {NotGsc,
         [](Bytes& f) {
             replaceMagic(f, {0xc2, 0x88, 'G', 'S', 'C'});
         }},
        {NotGsc,
         [](Bytes& f) {
             replaceMagic(f, {0xef, 0xbf, 0xbe, 'G', 'S'});
         }},
        {Truncated, [](Bytes& f) { f.clear(); }, {}, {}, Seal::None},
        {Truncated, [](Bytes& f) { f.resize(100); }, {}, {}, Seal::None},
        {Truncated, [](Bytes& f) { f.pop_back(); }, {}, {}, Seal::None},
        // the header admits to a length that the sections do not
        {Truncated,
         [](Bytes& f) {
             const SectionEntry& last = *sectionEntry(f, kSectionCameras);
             f.resize(last.offset + last.bytes + 1);
             header(f).file_bytes = f.size();
         }},
        {Truncated,
         [](Bytes& f) {
             f.resize(sizeof(FileHeader) + 10);
             header(f).file_bytes = f.size();
         },
         {},
         {},
         Seal::None},
        {MagicMangled,
         [](Bytes& f) {
             replaceMagic(f, {0x89, 'G', 'S', 'C', 0x0a, 0x1a, 0x0a});
         }},
        {MagicMangled,
         [](Bytes& f) {
             replaceMagic(f, {0x09, 'G', 'S', 'C', 0x0d, 0x0a, 0x1a, 0x0a});
         }},
        {MagicMangled,
         [](Bytes& f) {
             replaceMagic(f, {0xef, 0xbf, 0xbd, 'G', 'S', 'C', 0x0d, 0x0a});
         }},
        {MagicMangled,
         [](Bytes& f) {
             replaceMagic(f, {0xc2, 0x89, 'G', 'S', 'C', 0x0d, 0x0a, 0x1a});
         }},
        {VersionUnsupported, editHeader([](FileHeader& h) { h.version_major = 2; })},
        {VersionUnsupported, editHeader([](FileHeader& h) { h.version_major = 0; })},
        {HeaderBytes, editHeader([](FileHeader& h) { h.header_bytes = 256; })},
        {SectionTotal, editHeader([](FileHeader& h) { h.section_count = 0; }), {}, {}, Seal::None},
        {SectionTotal, editHeader([](FileHeader& h) { h.section_count = 65; }), {}, {}, Seal::None},
        {SectionTotal, editHeader([](FileHeader& h) { h.section_count = 0xffffffff; }), {}, {}, Seal::None},
        {SectionEntryBytes, editHeader([](FileHeader& h) { h.section_entry_bytes = 64; })},
        {SectionTableOffset, editHeader([](FileHeader& h) { h.section_offset = ~0ull; })},
        {TrailingBytes, [](Bytes& f) { f.push_back(std::byte{0}); }, {}, {}, Seal::None},
        {HeaderChecksum, editHeader([](FileHeader& h) { h.source_hash ^= 1; }), {}, {}, Seal::None},
        {HeaderReserved, editHeader([](FileHeader& h) { h.reserved0[6] = 1; })},
        {HeaderReserved, editHeader([](FileHeader& h) { h.reserved[5] = 1ull << 63; })},
        {ProfileUnsupported, editHeader([](FileHeader& h) { h.profile = 1; })},
        {AnchorTotal, editHeader([](FileHeader& h) { h.anchor_count = 0; })},
        {AnchorTotal, editHeader([](FileHeader& h) { h.anchor_count = 0xffffffff; })},

        {SectionUnknown, editSections([](std::vector<TinySection>& s) { s.push_back(foreign(0)); })},
        {SectionSkipped, editSections([](std::vector<TinySection>& s) { s.insert(s.begin() + 3, foreign(1)); })},
        {SectionMissing, editSections([](std::vector<TinySection>& s) { s.erase(s.begin()); })},
        {SectionMissing, editSections([](std::vector<TinySection>& s) { s.erase(s.begin() + 6); })},
        {SectionDuplicate, editSections([](std::vector<TinySection>& s) { s.push_back(s[4]); })},
        {SectionVersion, editEntry(kSectionGroups, [](SectionEntry& e) { e.version = 2; })},
        {SectionCodec, editEntry(kSectionIndex, [](SectionEntry& e) { e.codec = 1; })},
        {SectionFlagBits, editEntry(kSectionMeta, [](SectionEntry& e) { e.flags = 2; })},
        {SectionReserved, editEntry(kSectionMeta, [](SectionEntry& e) { e.reserved = 1; })},
        {SectionAlignment, editEntry(kSectionLeaves, [](SectionEntry& e) { e.offset += 8; })},
        {SectionRange, editEntry(kSectionCameras, [](SectionEntry& e) { e.offset = ~0ull - 4095; })},
        {SectionRange, editEntry(kSectionCameras, [](SectionEntry& e) { e.bytes = ~0ull; })},
        {SectionOverlap, editEntry(kSectionGroups, [](SectionEntry& e) { e.offset -= 4096; })},
        {SectionOverlap, editEntry(kSectionAnchors, [](SectionEntry& e) { e.offset = 0; })},
        {SectionGap,
         [](Bytes& f) {
             f.resize(f.size() + 4096);
             header(f).file_bytes = f.size();
         }},
        {SectionGap, // the last section moves one page on
         [](Bytes& f) {
             SectionEntry& e = *sectionEntry(f, kSectionCameras);
             f.insert(f.begin() + std::ptrdiff_t(e.offset), 4096, std::byte{0});
             sectionEntry(f, kSectionCameras)->offset += 4096;
             header(f).file_bytes = f.size();
         }},
        {SectionBytes, editEntry(kSectionParams, [](SectionEntry& e) { e.bytes -= 8; })},
        {SectionBytes, editEntry(kSectionLevels, [](SectionEntry& e) { e.bytes += 8; })},
        {SectionBytes, editEntry(kSectionChunks, [](SectionEntry& e) { e.bytes -= 1; })},
        {SectionBytes, editEntry(kSectionIndex, [](SectionEntry& e) { e.bytes -= 4; }), {PaddingNotZero}},
        {SectionBytes, editEntry(kSectionPacked, [](SectionEntry& e) { e.bytes = 255; }), {SectionGap, PaddingNotZero}},
        // counts whose product with the record size wraps
        {SectionBytes, editEntry(kSectionCameras, [](SectionEntry& e) { e.count = (1ull << 58) + 2; })},
        {SectionCount, editEntry(kSectionGroups, [](SectionEntry& e) { e.count = 0x3333333333333334; })},
        {SectionCount, editEntry(kSectionIndex, [](SectionEntry& e) { e.count += 1ull << 62; })},
        {SectionCount, editEntry(kSectionIndex, [](SectionEntry& e) { e.count -= 1; })},
        {SectionCount, editEntry(kSectionMeta, [](SectionEntry& e) { e.count = 1; })},
        {SectionCount, editEntry(kSectionAnchors, [](SectionEntry& e) { e.count = 0; })},
        {SectionCount, editEntry(kSectionParams, [](SectionEntry& e) { e.count = 2; })},
        {SectionCount, editEntry(kSectionLevels, [](SectionEntry& e) { e.count = 2; })},
        {SectionChecksum, [](Bytes& f) { section(f, kSectionNanoVdb)[100] ^= std::byte{1}; }, {}, {}, Seal::None},
        {SectionChecksum, editEntry(kSectionAnchors, [](SectionEntry& e) { e.checksum ^= 1; }), {}, {}, Seal::Header},
        {PaddingNotZero, [](Bytes& f) { f[kSectionAlign - 1] = std::byte{1}; }},
        {PaddingNotZero, [](Bytes& f) { f.back() = std::byte{1}; }},
        {AnchorsNotFirst, editSections([](std::vector<TinySection>& s) { std::swap(s[0], s[1]); })},
    };
}

} // namespace gsc::test
