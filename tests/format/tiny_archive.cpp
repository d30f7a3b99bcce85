// SPDX-License-Identifier: Apache-2.0
#include "tests/format/tiny_archive.h"

#include "format/archive/archive.h"
#include <gsc/checksum.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <fstream>

namespace gsc::test {

std::vector<std::byte> archiveOf(std::span<const std::byte> file, const std::string& folder, int threads)
{
    GscView view;
    if (!openGsc(file, view, GscCheck::Index, nullptr))
        std::abort();
    const std::string path = folder + "/tiny_archive.gsc";
    ArchiveOptions options;
    options.threads = threads;
    writeArchive(file, view, path, true, options, [](uint64_t, uint64_t) {});
    std::ifstream in(path, std::ios::binary | std::ios::ate);
    std::vector<std::byte> bytes(size_t(in.tellg()));
    in.seekg(0);
    in.read(reinterpret_cast<char*>(bytes.data()), std::streamsize(bytes.size()));
    return bytes;
}

std::vector<std::byte> tinyStepsGsc(const TinyGscOptions& options)
{
    std::vector<std::byte> file = tinyGsc(options);
    ModelParams& params = *records<ModelParams>(file, kSectionParams);
    params.flags |= kModelMaskedSlots;
    const auto round = [](float* values, size_t count, float steps) {
        for (size_t i = 0; i < count; ++i)
            values[i] = std::nearbyint(values[i] * steps) / steps + 0.0f; // and no -0
    };
    for (uint32_t c = 0; c < params.chunk_count; ++c) {
        const size_t n = records<ChunkRecord>(file, kSectionChunks)[c].anchor_count;
        float* const offset = payloadArray<float>(file, c, ChunkArray::Offset);
        round(offset, 3 * n * params.n_offsets, 64);
        for (size_t slot = 0; slot < n * params.n_offsets; slot += 4)
            std::fill_n(offset + 3 * slot, 3, std::bit_cast<float>(kMaskedOffset));
        round(payloadArray<float>(file, c, ChunkArray::Feature), n * params.feat_dim, 256);
    }
    reseal(file);
    return file;
}

ArchiveHeader& archiveHeader(std::span<std::byte> archive)
{
    return *reinterpret_cast<ArchiveHeader*>(section(archive, kSectionParts).data());
}

std::span<ArchivePart> archiveParts(std::span<std::byte> archive)
{
    const std::span<std::byte> list = section(archive, kSectionParts);
    // the fuzzer's tables are not sound
    if (list.size() < sizeof(ArchiveHeader) || reinterpret_cast<uintptr_t>(list.data()) % alignof(ArchivePart) != 0)
        return {};
    return {reinterpret_cast<ArchivePart*>(list.data() + sizeof(ArchiveHeader)),
            (list.size() - sizeof(ArchiveHeader)) / sizeof(ArchivePart)};
}

std::span<std::byte> storedPart(std::span<std::byte> archive, const ArchivePart& part)
{
    const std::span<std::byte> data = section(archive, kSectionData);
    if (part.offset > data.size() || part.bytes > data.size() - part.offset)
        return {};
    return data.subspan(size_t(part.offset), size_t(part.bytes));
}

AlignedRoom::AlignedRoom(uint64_t bytes) : m_room(size_t(bytes) + kSectionAlign)
{
    const size_t skip = (kSectionAlign - reinterpret_cast<uintptr_t>(m_room.data()) % kSectionAlign) % kSectionAlign;
    m_bytes = std::span(m_room).subspan(skip, size_t(bytes));
}

void resealArchive(std::span<std::byte> archive)
{
    if (archive.size() < sizeof(FileHeader) || header(archive).section_count > kMaxSections)
        return;
    std::vector<uint64_t> checksums;
    for (ArchivePart& part : archiveParts(archive)) {
        part.checksum = checksum64(storedPart(archive, part));
        checksums.push_back(part.checksum);
    }
    reseal(archive);
    if (SectionEntry* const data = sectionEntry(archive, kSectionData)) {
        data->checksum = checksum64(std::as_bytes(std::span(checksums)));
        header(archive).header_checksum = 0;
        const size_t front = sizeof(FileHeader) + header(archive).section_count * sizeof(SectionEntry);
        if (front <= archive.size())
            header(archive).header_checksum = checksum64(archive.first(front));
    }
}

} // namespace gsc::test
