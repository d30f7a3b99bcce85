// SPDX-License-Identifier: Apache-2.0
// Checks header and section table: all that must hold before a byte of content is read.
#include <gsc/archive_layout.h>
#include "format/validate/gsc_validate.h"

#include <algorithm>
#include <cstddef>

namespace gsc::validate {

namespace {

struct KnownSection {
    uint32_t type;
    bool required;
};

constexpr KnownSection kArchiveSections[] = {{kSectionData, true}, {kSectionParts, true}};
constexpr KnownSection kRuntimeSections[] = {
    {kSectionAnchors, true},  {kSectionMeta, true},         {kSectionParams, true}, {kSectionLevels, true},
    {kSectionChunks, true},   {kSectionGroups, true},       {kSectionLeaves, true}, {kSectionNanoVdb, true},
    {kSectionIndex, true},    {kSectionWeights, true},      {kSectionPacked, true}, {kSectionEmbedding, false},
    {kSectionCameras, false}, {kSectionSensitivity, false}, {kSectionTile, false},
};

// Sections that a file of this profile can have; the first one must also be the first in the file.
std::span<const KnownSection> knownSections(const Context& context)
{
    if (context.profile == Profile::Archive)
        return kArchiveSections;
    return kRuntimeSections;
}

bool isKnown(const Context& context, uint32_t type)
{
    return std::ranges::any_of(knownSections(context),
                               [type](const KnownSection& known) { return known.type == type; });
}

std::string hexText(std::span<const std::byte> bytes)
{
    std::string text;
    for (const std::byte b : bytes)
        text += formatString(text.empty() ? "%02x" : " %02x", unsigned(b));
    return text.empty() ? "nothing" : text;
}

// Returns true if the file starts with a magic that FTP's text mode, git's autocrlf or a mail program has changed.
bool looksMangled(std::span<const std::byte> start)
{
    const auto at = [&](size_t i) { return i < start.size() ? unsigned(start[i]) : 0u; };
    const bool high_bit_lost = at(0) == 0x09 && at(1) == 'G' && at(2) == 'S' && at(3) == 'C';
    const bool named = at(0) == 0x89 && at(1) == 'G' && at(2) == 'S' && at(3) == 'C';
    const bool utf8_twice = at(0) == 0xc2 && at(1) == 0x89 && at(2) == 'G' && at(3) == 'S' && at(4) == 'C';
    const bool replaced = at(0) == 0xef && at(1) == 0xbf && at(2) == 0xbd && at(3) == 'G' && at(4) == 'S';
    return high_bit_lost || named || utf8_twice || replaced;
}

bool checkMagic(Context& context)
{
    const size_t have = size_t(std::min<uint64_t>(context.file.size(), sizeof(kMagic)));
    const std::span<const std::byte> start = context.file.bytes().first(have);
    const std::span<const std::byte> magic = std::as_bytes(std::span(kMagic));
    if (std::equal(start.begin(), start.end(), magic.begin()))
        return true; // a file that ends within the magic counts as truncated
    if (looksMangled(start))
        GSC_REPORT(context.log, MagicMangled, 0, "/header/magic", hexText(start).c_str());
    else
        GSC_REPORT(context.log, NotGsc, 0, "/header/magic", hexText(start).c_str());
    return false;
}

void checkReserved(Context& context, const FileHeader& header)
{
    const auto bytes = std::as_bytes(std::span(&header, 1));
    const auto reserved = bytes.subspan(offsetof(FileHeader, reserved0),
                                        offsetof(FileHeader, header_checksum) - offsetof(FileHeader, reserved0));
    const size_t zeros = zeroPrefix(reserved);
    const size_t at = offsetof(FileHeader, reserved0) + zeros;
    if (zeros != reserved.size())
        GSC_REPORT(context.log, HeaderReserved, at, "/header/reserved", unsigned(at));
}

// Checks one entry of the table without regard to the others.
void checkEntry(Context& context, const SectionEntry& entry, uint32_t index)
{
    IssueLog& log = context.log;
    const uint64_t at = sizeof(FileHeader) + uint64_t(index) * sizeof(SectionEntry);
    const std::string name = fourCcText(entry.type);
    if (!isKnown(context, entry.type)) {
        if (entry.flags & kSectionOptional)
            GSC_REPORT(log, SectionSkipped, at, place("sections", index, "type"), name.c_str(), kVersionMajor);
        else
            GSC_REPORT(log, SectionUnknown, at, place("sections", index, "type"), name.c_str(), kVersionMajor);
    } else {
        if (entry.version != 1)
            GSC_REPORT(log, SectionVersion, at + offsetof(SectionEntry, version), place("sections", index, "version"),
                       name.c_str(), entry.version);
        if (entry.codec != 0)
            GSC_REPORT(log, SectionCodec, at + offsetof(SectionEntry, codec), place("sections", index, "codec"),
                       name.c_str(), entry.codec);
    }
    if (entry.flags & ~uint32_t(kSectionOptional))
        GSC_REPORT(log, SectionFlagBits, at + offsetof(SectionEntry, flags), place("sections", index, "flags"),
                   name.c_str(), entry.flags, unsigned(kSectionOptional));
    if (entry.reserved != 0)
        GSC_REPORT(log, SectionReserved, at + offsetof(SectionEntry, reserved), place("sections", index, "reserved"),
                   name.c_str(), entry.reserved);
    if (entry.offset % kSectionAlign != 0)
        GSC_REPORT(log, SectionAlignment, at + offsetof(SectionEntry, offset), place("sections", index, "offset"),
                   name.c_str(), entry.offset, kSectionAlign);
    if (!context.file.contains(entry.offset, entry.bytes))
        GSC_REPORT(log, SectionRange, at + offsetof(SectionEntry, offset), place("sections", index, "bytes"),
                   name.c_str(), entry.bytes, entry.offset, context.file.size());
}

// Checks that sections lie one behind the other, so every byte of the file belongs to something. Returns false if not.
bool checkOrder(Context& context)
{
    IssueLog& log = context.log;
    const FileHeader& header = *context.view.header;
    uint64_t end = sizeof(FileHeader) + uint64_t(header.section_count) * sizeof(SectionEntry);
    uint32_t index = 0;
    for (const SectionEntry& entry : context.view.sections) {
        const uint64_t at =
            sizeof(FileHeader) + uint64_t(index) * sizeof(SectionEntry) + offsetof(SectionEntry, offset);
        if (entry.offset < end) {
            GSC_REPORT(log, SectionOverlap, at, place("sections", index, "offset"), fourCcText(entry.type).c_str(),
                       entry.offset, end);
            return false;
        }
        if (const uint64_t expected = alignUp(end, kSectionAlign); entry.offset != expected)
            GSC_REPORT(log, SectionGap, at, place("sections", index, "offset"), entry.offset - expected, entry.offset,
                       expected);
        end = entry.offset + entry.bytes;
        ++index;
    }
    if (const uint64_t expected = alignUp(end, kSectionAlign); header.file_bytes > expected)
        GSC_REPORT(log, SectionGap, expected, "/header/file_bytes", header.file_bytes - expected, header.file_bytes,
                   expected);
    else if (header.file_bytes < expected)
        GSC_REPORT(log, Truncated, header.file_bytes, "/header/file_bytes", header.file_bytes, expected);
    return !log.fatal();
}

} // namespace

bool checkHeader(Context& context)
{
    IssueLog& log = context.log;
    if (!checkMagic(context))
        return false;
    const auto records = context.file.array<FileHeader>(0, 1);
    if (!records) {
        GSC_REPORT(log, Truncated, context.file.size(), "/header", context.file.size(), uint64_t(sizeof(FileHeader)));
        return false;
    }
    const FileHeader& header = records->front();
    context.view.header = &header;
    if (header.version_major != kVersionMajor) {
        GSC_REPORT(log, VersionUnsupported, offsetof(FileHeader, version_major), "/header/version_major",
                   header.version_major, header.version_minor, kVersionMajor);
        return false;
    }
    if (header.header_bytes != sizeof(FileHeader))
        GSC_REPORT(log, HeaderBytes, offsetof(FileHeader, header_bytes), "/header/header_bytes", header.header_bytes,
                   unsigned(sizeof(FileHeader)));
    if (header.section_entry_bytes != sizeof(SectionEntry))
        GSC_REPORT(log, SectionEntryBytes, offsetof(FileHeader, section_entry_bytes), "/header/section_entry_bytes",
                   header.section_entry_bytes, unsigned(sizeof(SectionEntry)));
    if (header.section_offset != sizeof(FileHeader))
        GSC_REPORT(log, SectionTableOffset, offsetof(FileHeader, section_offset), "/header/section_offset",
                   header.section_offset, uint64_t(sizeof(FileHeader)));
    if (header.section_count < 1 || header.section_count > kMaxSections)
        GSC_REPORT(log, SectionTotal, offsetof(FileHeader, section_count), "/header/section_count",
                   header.section_count, kMaxSections);
    if (header.file_bytes > context.file.size())
        GSC_REPORT(log, Truncated, context.file.size(), "/header/file_bytes", context.file.size(), header.file_bytes);
    else if (header.file_bytes < context.file.size())
        GSC_REPORT(log, TrailingBytes, header.file_bytes, "/header/file_bytes", context.file.size(), header.file_bytes);
    if (log.fatal())
        return false;

    // from here on only the bytes that the header states are looked at; more bytes in the file were reported
    context.file = ByteView(context.file.bytes().first(size_t(header.file_bytes)));
    const auto table = context.file.array<SectionEntry>(sizeof(FileHeader), header.section_count);
    if (!table) {
        GSC_REPORT(log, Truncated, context.file.size(), "/sections", context.file.size(),
                   sizeof(FileHeader) + uint64_t(header.section_count) * sizeof(SectionEntry));
        return false;
    }
    if (!checkHeaderChecksum(context, header, std::as_bytes(*table)))
        return false;
    if (header.profile != uint8_t(context.profile))
        GSC_REPORT(log, ProfileUnsupported, offsetof(FileHeader, profile), "/header/profile", header.profile,
                   unsigned(context.profile));
    if (header.anchor_count < 1 || header.anchor_count > kMaxAnchors)
        GSC_REPORT(log, AnchorTotal, offsetof(FileHeader, anchor_count), "/header/anchor_count", header.anchor_count,
                   kMaxAnchors);
    checkReserved(context, header);
    context.view.sections = *table;
    return !log.fatal();
}

bool checkTable(Context& context)
{
    IssueLog& log = context.log;
    const std::span<const SectionEntry> sections = context.view.sections;
    for (uint32_t i = 0; i < sections.size(); ++i) {
        checkEntry(context, sections[i], i);
        for (uint32_t k = 0; k < i; ++k)
            if (sections[k].type == sections[i].type) {
                GSC_REPORT(log, SectionDuplicate, sizeof(FileHeader) + i * sizeof(SectionEntry),
                           place("sections", i, "type"), fourCcText(sections[i].type).c_str(), i);
                break;
            }
    }
    for (const KnownSection& known : knownSections(context))
        if (known.required && !context.entry(known.type))
            GSC_REPORT(log, SectionMissing, sizeof(FileHeader), "/sections", fourCcText(known.type).c_str());
    if (log.fatal())
        return false;
    if (const uint32_t first = knownSections(context).front().type; sections.front().type != first)
        GSC_REPORT(log, AnchorsNotFirst, sizeof(FileHeader), "/sections/0/type",
                   fourCcText(sections.front().type).c_str(), fourCcText(first).c_str());
    return checkOrder(context);
}

void checkPadding(Context& context)
{
    const auto check = [&](uint64_t from, uint64_t to) {
        const auto bytes = context.file.slice(from, to - from).value_or(std::span<const std::byte>{});
        const size_t zeros = zeroPrefix(bytes);
        if (zeros != bytes.size())
            GSC_REPORT(context.log, PaddingNotZero, from + zeros, "", from + zeros, unsigned(bytes[zeros]));
    };
    uint64_t end = sizeof(FileHeader) + uint64_t(context.view.header->section_count) * sizeof(SectionEntry);
    for (const SectionEntry& entry : context.view.sections) {
        check(end, entry.offset);
        end = entry.offset + entry.bytes;
    }
    check(end, context.file.size());
}

} // namespace gsc::validate
