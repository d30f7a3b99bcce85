// SPDX-License-Identifier: Apache-2.0
#include "format/archive/archive.h"

#include "format/archive/part_threads.h"
#include <gsc/checksum.h>
#include <gsc/interrupt.h>
#include "format/validate/gsc_validate.h"

#include <algorithm>
#include <cstring>
#include <mutex>
#include <optional>
#include <set>

namespace gsc {

using namespace validate;

namespace {

bool isSummary(uint32_t type)
{
    return type == kArchiveFront || type == kSectionMeta || type == kSectionParams || type == kSectionLevels;
}

std::string partPlace(size_t part, const char* field)
{
    return place("parts", part, field);
}

// Checks the list of parts: each part lies in its section, and its size is in proportion to its stored bytes.
bool checkParts(IssueLog& log, const ArchiveHeader& header, std::span<const ArchivePart> parts, uint64_t list_offset,
                uint64_t data_bytes)
{
    if (header.reserved0 != 0 || std::ranges::any_of(header.reserved, [](uint64_t r) { return r != 0; }))
        GSC_REPORT(log, ArchiveReserved, list_offset, "/parts", "the list of parts");
    if (header.raw_bytes % kSectionAlign != 0)
        GSC_REPORT(log, ArchiveRawBytes, list_offset, "/parts/raw_bytes", header.raw_bytes);
    uint64_t raw_end = 0, end = 0;
    std::set<uint32_t> seen; // types of the sections seen so far: each section is one part, only ANCH is several
    for (size_t i = 0; i < parts.size() && !log.fatal(); ++i) {
        const ArchivePart& part = parts[i];
        const uint64_t at = list_offset + sizeof(ArchiveHeader) + i * sizeof(ArchivePart);
        if (part.offset != end || part.bytes > data_bytes - end)
            GSC_REPORT(log, ArchivePartRange, at, partPlace(i, "offset"), part.bytes, part.offset, end, data_bytes);
        else if (part.raw_offset < raw_end || part.raw_offset % kPayloadAlign != 0 ||
                 part.raw_offset > header.raw_bytes || part.raw_bytes > header.raw_bytes - part.raw_offset)
            GSC_REPORT(log, ArchivePartRaw, at, partPlace(i, "raw_offset"), part.raw_bytes, part.raw_offset, raw_end,
                       header.raw_bytes);
        else if ((i == 0) != (part.type == kArchiveFront) || (i == 0 && part.raw_offset != 0))
            GSC_REPORT(log, ArchiveFront, at, partPlace(i, "type"), fourCcText(part.type).c_str(), part.raw_offset);
        // INDX is stored as nothing, so its size has another limit: it is one part, no larger than the chunk payloads
        // before it, from which it follows
        else if (part.type == kSectionIndex ? part.raw_bytes > raw_end
                                            : part.raw_bytes > kFreeExpansion &&
                                                  (part.raw_bytes - kFreeExpansion) / kMaxExpansion > part.bytes)
            GSC_REPORT(log, ArchiveExpansion, at, partPlace(i, "raw_bytes"), part.raw_bytes, part.bytes);
        else if (part.type != kSectionAnchors && !seen.insert(part.type).second)
            GSC_REPORT(log, ArchiveFront, at, partPlace(i, "type"), fourCcText(part.type).c_str(), part.raw_offset);
        raw_end = part.raw_offset + part.raw_bytes;
        end = part.offset + part.bytes;
    }
    if (!log.fatal() && end != data_bytes)
        GSC_REPORT(log, ArchivePartRange, list_offset, "/parts", uint64_t(0), end, data_bytes, data_bytes);
    return !log.fatal();
}

// Checks that the file ends with the page of its last part: then it cannot claim to be larger than its parts.
bool checkEnd(IssueLog& log, const ArchiveHeader& header, std::span<const ArchivePart> parts, uint64_t list_offset)
{
    const uint64_t end = parts.empty() ? 0 : parts.back().raw_offset + parts.back().raw_bytes;
    uint64_t last = 0;
    bool gap = parts.empty() || alignUp(end, kSectionAlign) != header.raw_bytes;
    for (const ArchivePart& part : parts) {
        gap |= part.raw_offset - last >= kSectionAlign;
        last = part.raw_offset + part.raw_bytes;
    }
    if (gap)
        GSC_REPORT(log, ArchiveRawBytes, list_offset, "/parts/raw_bytes", header.raw_bytes);
    return !gap;
}

} // namespace

bool isArchive(std::span<const std::byte> file)
{
    FileHeader header;
    if (file.size() < sizeof(header))
        return false;
    std::memcpy(&header, file.data(), sizeof(header));
    return std::memcmp(header.magic, kMagic, sizeof(kMagic)) == 0 && header.version_major == kVersionMajor &&
           header.profile == uint8_t(Profile::Archive);
}

Archive::Archive(std::span<const std::byte> file, const IssueSink& sink)
{
    IssueLog log(sink);
    GscView view;
    Context context{ByteView(file), view, log, Profile::Archive};
    if (!checkHeader(context) || !checkTable(context))
        return;
    checkPadding(context);
    checkSectionChecksums(context, SummaryOnly::No);
    const SectionEntry& list = *context.entry(kSectionParts);
    const SectionEntry& data = *context.entry(kSectionData);
    const ByteView bytes(context.content(list));
    const auto header = bytes.load<ArchiveHeader>(0);
    const auto parts = bytes.array<ArchivePart>(sizeof(ArchiveHeader), header ? header->part_count : 0);
    if (!header || !parts || list.count != header->part_count || data.count != header->part_count ||
        list.bytes != sizeof(ArchiveHeader) + uint64_t(header->part_count) * sizeof(ArchivePart)) {
        GSC_REPORT(log, ArchiveList, list.offset, "/parts", list.bytes, list.count);
        return;
    }
    if (!checkParts(log, *header, *parts, list.offset, data.bytes) || !checkEnd(log, *header, *parts, list.offset))
        return;
    std::vector<uint64_t> checksums;
    for (const ArchivePart& part : *parts)
        checksums.push_back(part.checksum);
    if (const uint64_t sum = checksum64(std::as_bytes(std::span(checksums))); sum != data.checksum)
        GSC_REPORT(log, SectionChecksum, data.offset, "/sections/DATA/checksum", "DATA", sum, data.checksum);
    m_data = context.content(data);
    m_data_offset = data.offset;
    m_parts = *parts;
    m_raw_bytes = header->raw_bytes;
    m_sound = log.errors() == 0;
}

uint64_t Archive::decodedBytes(Scope scope) const
{
    uint64_t bytes = 0;
    for (const ArchivePart& part : m_parts)
        if (scope == Scope::All || isSummary(part.type))
            bytes += part.raw_bytes;
    return bytes;
}

bool Archive::decode(std::span<std::byte> out, Scope scope, int threads, const IssueSink& sink) const
{
    std::mutex mutex; // held by a thread while it reads or writes any of the variables below
    IssueLog log(sink);
    std::vector<SourceArray> sources;
    std::optional<size_t> inverse;
    const auto rawOf = [&](const ArchivePart& part) {
        return out.subspan(size_t(part.raw_offset), size_t(part.raw_bytes));
    };
    const auto checkContent = [&](size_t i) {
        const uint64_t sum = checksum64(rawOf(m_parts[i]));
        const std::lock_guard lock(mutex);
        if (sum != m_parts[i].raw_checksum)
            GSC_REPORT(log, ArchiveContent, m_data_offset + m_parts[i].offset, partPlace(i, "raw_checksum"), sum,
                       m_parts[i].raw_checksum);
    };
    const auto report = [&](size_t i, PartFault fault, Codec codec) {
        const uint64_t at = m_data_offset + m_parts[i].offset;
        const std::string type = fourCcText(m_parts[i].type);
        const std::lock_guard lock(mutex);
        if (fault == PartFault::UnknownCodec)
            GSC_REPORT(log, ArchiveCodecUnknown, at, partPlace(i, ""), unsigned(codec));
        else if (fault == PartFault::MissingCodec)
            GSC_REPORT(log, ArchiveCodecMissing, at, partPlace(i, ""), codecName(codec));
        else
            GSC_REPORT(log, ArchiveUndecodable, at, partPlace(i, ""), type.c_str(),
                       fault == PartFault::Streams ? "what its streams say does not fit it" : "a stream is damaged");
    };
    onPartThreads(m_parts.size(), threads, [&] {
        return [&, decoder = PartDecoder()](size_t i) mutable {
            const ArchivePart& part = m_parts[i];
            if (scope == Scope::Summary && !isSummary(part.type))
                return;
            throwIfInterrupted();
            const auto stored = m_data.subspan(size_t(part.offset), size_t(part.bytes));
            if (const uint64_t sum = checksum64(stored); sum != part.checksum) {
                const std::lock_guard lock(mutex);
                GSC_REPORT(log, ArchiveChecksum, m_data_offset + part.offset, partPlace(i, "checksum"), sum,
                           part.checksum);
                return;
            }
            const PartFault fault = decoder.decode(part, stored, rawOf(part));
            if (fault != PartFault::None)
                return report(i, fault, decoder.faultCodec());
            if (decoder.isInverse() && part.type != kSectionIndex)
                return report(i, PartFault::Streams, Codec::Inverse);
            if (!decoder.isInverse())
                checkContent(i);
            const std::lock_guard lock(mutex);
            if (decoder.sources())
                sources.push_back(*decoder.sources());
            if (decoder.isInverse())
                inverse = i;
        };
    });
    if (log.errors() > 0)
        return false;
    std::ranges::sort(sources, {}, &SourceArray::offset); // makes the order independent of the threads
    if (inverse && invertSources(out, sources, rawOf(m_parts[*inverse])))
        checkContent(*inverse);
    else if (inverse)
        report(*inverse, PartFault::Content, Codec::Inverse);
    return log.errors() == 0;
}

} // namespace gsc
