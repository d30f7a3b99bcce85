// SPDX-License-Identifier: Apache-2.0
// Checks the checksums of the header with the section table, of the sections, and of the payload of each chunk.
#include "format/validate/gsc_validate.h"

#include <gsc/archive_layout.h>
#include <gsc/checksum.h>

#include <cstddef>
#include <cstring>

namespace gsc::validate {

namespace {

uint64_t headerChecksum(std::span<const std::byte> header, std::span<const std::byte> table)
{
    FileHeader copy;
    std::memcpy(&copy, header.data(), sizeof(copy));
    copy.header_checksum = 0;
    Checksum64 sum;
    sum.update(std::as_bytes(std::span(&copy, 1)));
    sum.update(table);
    return sum.digest();
}

} // namespace

bool checkHeaderChecksum(Context& context, const FileHeader& header, std::span<const std::byte> table)
{
    const uint64_t sum = headerChecksum(context.file.bytes().first(sizeof(FileHeader)), table);
    if (sum == header.header_checksum)
        return true;
    GSC_REPORT(context.log, HeaderChecksum, offsetof(FileHeader, header_checksum), "/header/header_checksum", sum,
               header.header_checksum);
    return false;
}

void checkSectionChecksums(Context& context, SummaryOnly summary)
{
    const auto wanted = [summary](uint32_t type) {
        return summary == SummaryOnly::No ? type != kSectionAnchors && type != kSectionData
                                          : type == kSectionMeta || type == kSectionParams || type == kSectionLevels;
    };
    uint32_t index = 0;
    for (const SectionEntry& entry : context.view.sections) {
        if (wanted(entry.type)) {
            const uint64_t sum = checksum64(context.content(entry));
            if (sum != entry.checksum)
                GSC_REPORT(context.log, SectionChecksum, entry.offset, place("sections", index, "checksum"),
                           fourCcText(entry.type).c_str(), sum, entry.checksum);
        }
        ++index;
    }
}

void checkAnchorsChecksum(Context& context, const SectionEntry& anchors)
{
    Checksum64 sum;
    for (const ChunkRecord& chunk : context.view.chunks)
        sum.update(std::as_bytes(std::span(&chunk.checksum, 1)));
    if (sum.digest() != anchors.checksum)
        GSC_REPORT(context.log, SectionChecksum, anchors.offset, "/sections/ANCH/checksum", "ANCH", sum.digest(),
                   anchors.checksum);
}

void checkChunkChecksum(IssueLog& log, const ChunkRecord& chunk, uint32_t index, std::span<const std::byte> payload,
                        uint64_t payload_at)
{
    const uint64_t sum = checksum64(payload);
    if (sum != chunk.checksum)
        GSC_REPORT(log, PayloadChecksum, payload_at, place("chunks", index, "checksum"), sum, chunk.checksum);
}

} // namespace gsc::validate
