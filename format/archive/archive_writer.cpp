// SPDX-License-Identifier: Apache-2.0
#include "format/archive/archive.h"

#include "format/archive/part_threads.h"
#include <gsc/checksum.h>
#include <gsc/error.h>
#include <gsc/gsc_writer.h>
#include <gsc/interrupt.h>

#include <algorithm>
#include <atomic>
#include <cstring>

namespace gsc {

namespace {

constexpr size_t kPartsAtOnce = 8; // encoded parts that may wait in memory for earlier ones to be written, per thread

void checkGap(const std::string& path, std::span<const std::byte> file, uint64_t from, uint64_t to)
{
    const auto gap = file.subspan(size_t(from), size_t(to - from));
    const auto bad = std::ranges::find_if(gap, [](std::byte b) { return b != std::byte{0}; });
    if (bad != gap.end())
        throw Error(ErrorCode::InvalidFile, path,
                    formatString("byte %llu of the file to be archived is 0x%02x",
                                 (unsigned long long)(from + uint64_t(bad - gap.begin())), unsigned(*bad)),
                    "zero between its parts", "see everything that is wrong with it")
            .with({Setting::Validation});
}

void checkCodec()
{
    if (!hasCodec(Codec::Zstd))
        throw Error(ErrorCode::Unsupported, "codec zstd", "not part of this build", "one that has it",
                    "build it with GSC_WITH_ZSTD");
}

void addTo(ArchiveSizes& sizes, const ArchivePart& part)
{
    if (sizes.sections.empty() || sizes.sections.back().type != part.type)
        sizes.sections.push_back({part.type});
    sizes.sections.back().raw_bytes += part.raw_bytes;
    sizes.sections.back().stored_bytes += part.bytes;
}

} // namespace

ArchiveSizes writeArchive(std::span<const std::byte> file, const GscView& view, const std::string& path, bool overwrite,
                          const ArchiveOptions& options, const std::function<void(uint64_t, uint64_t)>& progress)
{
    checkCodec();
    const std::vector<RawPart> raw = cutIntoParts(file, view);
    uint64_t end = 0;
    for (const RawPart& part : raw) {
        checkGap(path, file, end, part.raw_offset);
        end = part.raw_offset + part.bytes.size();
    }
    checkGap(path, file, end, file.size());

    GscWriter writer(path, overwrite);
    writer.beginSection(kSectionData);
    std::vector<ArchivePart> parts;
    std::vector<uint64_t> checksums;
    ArchiveSizes sizes;
    uint64_t offset = 0;
    std::vector<PartEncoder> encoders; // one per thread, kept from batch to batch for their memory
    const size_t threads = partThreads(raw.size(), options.threads);
    for (size_t i = 0; i < threads; ++i)
        encoders.emplace_back(view, options.level);
    for (size_t first = 0; first < raw.size();) {
        const size_t count = std::min(raw.size() - first, threads * kPartsAtOnce);
        std::vector<StoredPart> batch(count);
        std::atomic<size_t> thread{0};
        onPartThreads(count, options.threads, [&] {
            return [&, &encoder = encoders[thread++]](size_t i) {
                throwIfInterrupted();
                batch[i] = encoder.encode(raw[first + i]);
            };
        });
        for (StoredPart& stored : batch) {
            stored.record.offset = offset;
            writer.append(stored.bytes);
            offset += stored.bytes.size();
            checksums.push_back(stored.record.checksum);
            addTo(sizes, stored.record);
            parts.push_back(stored.record);
        }
        first += count;
        const RawPart& last = raw[first - 1];
        progress(last.raw_offset + last.bytes.size(), file.size());
    }

    writer.endSection(parts.size(), checksum64(std::as_bytes(std::span(checksums))));
    ArchiveHeader archive{};
    archive.raw_bytes = file.size();
    archive.part_count = uint32_t(parts.size());
    std::vector<std::byte> list(sizeof(archive) + parts.size() * sizeof(ArchivePart));
    std::memcpy(list.data(), &archive, sizeof(archive));
    std::memcpy(list.data() + sizeof(archive), parts.data(), parts.size() * sizeof(ArchivePart));
    writer.addSection(kSectionParts, list, parts.size());
    FileHeader header = *view.header; // a copy, so that the archive keeps the fields that identify the model
    header.profile = uint8_t(Profile::Archive);
    sizes.stored_bytes = writer.finish(header, 0);
    throwIfInterrupted();
    writer.commit();
    sizes.raw_bytes = file.size();
    return sizes;
}

} // namespace gsc
