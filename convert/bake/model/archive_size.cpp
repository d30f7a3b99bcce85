// SPDX-License-Identifier: Apache-2.0
#include "convert/bake/model/archive_size.h"

#include "format/archive/archive.h"
#include "format/archive/part_threads.h"
#include <gsc/interrupt.h>

#include <atomic>
#include <cstring>
#include <mutex>

namespace gsc {

namespace {

// Adds the packed bytes of the streams of a chunk to `sizes`. A stream is part of one array, or of positions and source
// indices.
void addStreams(const GscView& view, const RawPart& part, const StoredPart& stored, StoredBytes& sizes)
{
    const ChunkArrayLayout layout = chunkArrayLayout(*view.params, view.chunks[part.chunk].anchor_count);
    for (uint32_t i = 0; i < stored.record.stream_count; ++i) {
        ArchiveStream stream;
        std::memcpy(&stream, stored.bytes.data() + i * sizeof(stream), sizeof(stream));
        uint32_t array = 0;
        while (array + 1 < uint32_t(ChunkArray::Count) &&
               (layout.stride[array + 1] == 0 || layout.offset[array + 1] <= stream.raw_offset))
            ++array;
        while (layout.stride[array] == 0)
            --array;
        uint64_t& to = array <= uint32_t(ChunkArray::SourceIndex) ? sizes.positions
                       : ChunkArray(array) == ChunkArray::Scale   ? sizes.scales
                       : ChunkArray(array) == ChunkArray::Offset  ? sizes.offsets
                       : ChunkArray(array) == ChunkArray::Feature ? sizes.features
                                                                  : sizes.other_anchors;
        to += stream.bytes;
        sizes.other_anchors += sizeof(stream);
    }
}

} // namespace

StoredBytes archiveSize(const GscFile& file, const GscView& view, int threads)
{
    const std::vector<RawPart> parts = cutIntoParts(file.bytes(), view);
    StoredBytes sizes;
    std::mutex mutex; // guards `sizes`; the order of adding does not matter
    uint64_t stored_bytes = 0;
    onPartThreads(parts.size(), threads, [&] {
        return [&, encoder = PartEncoder(view, ArchiveOptions().level)](size_t i) mutable {
            throwIfInterrupted();
            const StoredPart stored = encoder.encode(parts[i]);
            file.letGo(parts[i].bytes);
            const std::lock_guard lock(mutex);
            stored_bytes += stored.bytes.size();
            if (parts[i].type == kSectionAnchors)
                addStreams(view, parts[i], stored, sizes);
            else
                (parts[i].type == kSectionWeights || parts[i].type == kSectionPacked ? sizes.networks : sizes.rest) +=
                    stored.bytes.size();
        };
    });
    // the archive has the header and section table, section DATA and section PART, each on pages of its own
    sizes.file = kSectionAlign + alignUp(stored_bytes, kSectionAlign) +
                 alignUp(sizeof(ArchiveHeader) + parts.size() * sizeof(ArchivePart), kSectionAlign);
    sizes.rest = sizes.file - sizes.anchors() - sizes.networks;
    return sizes;
}

} // namespace gsc
