// SPDX-License-Identifier: Apache-2.0
#include "tests/format/tiny_gsc.h"

#include <gsc/byte_view.h>
#include <gsc/checksum.h>

#include <algorithm>
#include <cstring>

namespace gsc::test {

namespace {

// The table as far as it lies in the file and in kMaxSections.
std::span<SectionEntry> table(std::span<std::byte> file)
{
    if (file.size() < sizeof(FileHeader))
        return {};
    const uint64_t fit = (file.size() - sizeof(FileHeader)) / sizeof(SectionEntry);
    const uint64_t count = std::min<uint64_t>({header(file).section_count, fit, kMaxSections});
    return {reinterpret_cast<SectionEntry*>(file.data() + sizeof(FileHeader)), size_t(count)};
}

std::span<std::byte> contentOf(std::span<std::byte> file, const SectionEntry& entry)
{
    if (!ByteView(file).contains(entry.offset, entry.bytes))
        return {};
    return file.subspan(size_t(entry.offset), size_t(entry.bytes));
}

void sealPayloads(std::span<std::byte> file)
{
    const SectionEntry* const chunks = sectionEntry(file, kSectionChunks);
    SectionEntry* const anchors = sectionEntry(file, kSectionAnchors);
    if (!chunks || !anchors || chunks->offset % alignof(ChunkRecord) != 0)
        return;
    const std::span<std::byte> content = contentOf(file, *chunks);
    const std::span<std::byte> payloads = contentOf(file, *anchors);
    Checksum64 sum;
    for (uint64_t i = 0; i < content.size() / sizeof(ChunkRecord); ++i) {
        ChunkRecord& chunk = reinterpret_cast<ChunkRecord*>(content.data())[i];
        if (ByteView(payloads).contains(chunk.payload_offset, chunk.payload_bytes))
            chunk.checksum = checksum64(payloads.subspan(size_t(chunk.payload_offset), size_t(chunk.payload_bytes)));
        sum.update(std::as_bytes(std::span(&chunk.checksum, 1)));
    }
    anchors->checksum = sum.digest();
}

} // namespace

SectionEntry* sectionEntry(std::span<std::byte> file, uint32_t type)
{
    for (SectionEntry& entry : table(file))
        if (entry.type == type)
            return &entry;
    return nullptr;
}

std::span<std::byte> section(std::span<std::byte> file, uint32_t type)
{
    const SectionEntry* const entry = sectionEntry(file, type);
    return entry ? contentOf(file, *entry) : std::span<std::byte>{};
}

std::vector<std::byte> assembleGsc(FileHeader head, std::vector<TinySection> sections)
{
    uint64_t end = sizeof(FileHeader) + sections.size() * sizeof(SectionEntry);
    for (TinySection& s : sections) {
        s.entry.offset = alignUp(end, kSectionAlign);
        s.entry.bytes = s.content.size();
        end = s.entry.offset + s.entry.bytes;
    }
    std::copy(std::begin(kMagic), std::end(kMagic), head.magic);
    head.version_major = kVersionMajor;
    head.version_minor = kVersionMinor;
    head.header_bytes = sizeof(FileHeader);
    head.file_bytes = alignUp(end, kSectionAlign);
    head.section_count = uint32_t(sections.size());
    head.section_entry_bytes = sizeof(SectionEntry);
    head.section_offset = sizeof(FileHeader);

    std::vector<std::byte> file(head.file_bytes);
    std::memcpy(file.data(), &head, sizeof(head));
    for (size_t i = 0; i < sections.size(); ++i) {
        std::memcpy(file.data() + sizeof(head) + i * sizeof(SectionEntry), &sections[i].entry, sizeof(SectionEntry));
        if (!sections[i].content.empty())
            std::memcpy(file.data() + sections[i].entry.offset, sections[i].content.data(), sections[i].content.size());
    }
    reseal(file);
    return file;
}

std::vector<TinySection> takeApart(std::span<std::byte> file)
{
    std::vector<TinySection> sections;
    for (const SectionEntry& entry : table(file)) {
        const std::span<std::byte> content = contentOf(file, entry);
        sections.push_back({entry, {content.begin(), content.end()}});
    }
    return sections;
}

void reseal(std::span<std::byte> file)
{
    sealPayloads(file);
    for (SectionEntry& entry : table(file))
        if (entry.type != kSectionAnchors)
            entry.checksum = checksum64(contentOf(file, entry));
    if (file.size() < sizeof(FileHeader))
        return;
    FileHeader copy = header(file);
    copy.header_checksum = 0;
    Checksum64 sum;
    sum.update(std::as_bytes(std::span(&copy, 1)));
    sum.update(std::as_bytes(table(file)));
    header(file).header_checksum = sum.digest();
}

HeapCopy::HeapCopy(std::span<const std::byte> source) : data(new std::byte[source.size()]), size(source.size())
{
    std::copy(source.begin(), source.end(), data.get());
}

} // namespace gsc::test
