// SPDX-License-Identifier: Apache-2.0
#include "convert/write/distribute.h"

#include "format/numbers/count_text.h"
#include "convert/write/anchor_record.h"
#include "convert/write/batch_stream.h"
#include <gsc/error.h>

#include <algorithm>
#include <cstring>
#include <vector>

namespace gsc {

namespace {

constexpr uint64_t kMaxChunkBuffer = 1 << 20; // bytes of a chunk's buffer; larger ones gain nothing

// Collects the records of each chunk in a buffer and writes it when it is full.
class RegionWriter {
public:
    RegionWriter(std::span<const ChunkRecord> chunks, uint32_t record_bytes, uint64_t buffer_bytes, GscWriter& writer)
        : m_chunks(chunks), m_record_bytes(record_bytes), m_writer(writer), m_buffers(chunks.size())
    {
        const uint64_t share = std::min(buffer_bytes / chunks.size(), kMaxChunkBuffer);
        m_records_per_buffer = uint32_t(std::max<uint64_t>(1, share / record_bytes));
    }

    std::byte* append(uint32_t chunk)
    {
        Buffer& buffer = m_buffers[chunk];
        if (buffer.written + buffer.held == m_chunks[chunk].anchor_count)
            throw Error(ErrorCode::InvalidFile, formatString("chunk %u", chunk),
                        formatString("gets more than %u anchors", m_chunks[chunk].anchor_count),
                        "those the scan counted", "convert again while nobody changes the checkpoint");
        if (buffer.bytes.empty())
            buffer.bytes.resize(size_t(std::min(m_records_per_buffer, m_chunks[chunk].anchor_count)) * m_record_bytes);
        if (size_t(buffer.held) * m_record_bytes == buffer.bytes.size())
            flush(chunk);
        return buffer.bytes.data() + size_t(buffer.held++) * m_record_bytes;
    }

    void finish()
    {
        for (uint32_t chunk = 0; chunk < m_chunks.size(); ++chunk) {
            flush(chunk);
            if (m_buffers[chunk].written != m_chunks[chunk].anchor_count)
                throw Error(ErrorCode::InvalidFile, formatString("chunk %u", chunk),
                            "gets " + formatCount(m_buffers[chunk].written, "anchor"),
                            formatString("the %s the scan counted", formatCount(m_chunks[chunk].anchor_count).c_str()),
                            "convert again while nobody changes the checkpoint");
            m_buffers[chunk].bytes = {};
        }
    }

private:
    struct Buffer {
        std::vector<std::byte> bytes;
        uint32_t held = 0, written = 0; // records in the buffer; records written
    };

    void flush(uint32_t chunk)
    {
        Buffer& buffer = m_buffers[chunk];
        m_writer.writeAnchors(m_chunks[chunk].payload_offset + uint64_t(buffer.written) * m_record_bytes,
                              std::span(buffer.bytes).first(size_t(buffer.held) * m_record_bytes));
        buffer.written += buffer.held;
        buffer.held = 0;
    }

    std::span<const ChunkRecord> m_chunks;
    uint32_t m_record_bytes;
    GscWriter& m_writer;
    uint32_t m_records_per_buffer = 1;
    std::vector<Buffer> m_buffers;
};

} // namespace

void distributeAnchors(AnchorSource& source, const ScanResult& scan, const Partition& partition,
                       const ModelParams& params, std::span<const ChunkRecord> chunks, uint64_t buffer_bytes,
                       GscWriter& writer, const std::function<void(uint64_t)>& progress)
{
    const AnchorRecordLayout layout = anchorRecordLayout(params);
    RegionWriter regions(chunks, layout.bytes, buffer_bytes, writer);
    ChunkFinder finder(partition);
    DroppedRows dropped(scan.dropped);
    uint64_t done = 0;

    const auto put = [&](std::byte* record, ChunkArray array, const void* values) {
        if (const uint32_t stride = layout.stride[uint32_t(array)])
            std::memcpy(record + layout.offset[uint32_t(array)], values, stride);
    };
    forEachBatch(source, kAnchorAll, [&](const AnchorBatch& batch) {
        for (size_t i = 0; i < batch.count; ++i) {
            const uint64_t row = batch.first + i;
            if (dropped.isDropped(row))
                continue;
            const uint32_t source_index = uint32_t(row - dropped.before());
            const float* position = &batch.position[3 * i];
            const uint32_t level_index = partition.levelIndex(batch.level[i]);
            const QuantaPosition at = placeAnchor(partition.encoding, partition.levels[level_index], position);
            const uint32_t chunk = finder.find(level_index, at);

            std::byte* record = regions.append(chunk);
            if (partition.encoding == PositionEncoding::Grid) {
                GridPosition local{};
                for (int axis = 0; axis < 3; ++axis)
                    local.local[axis] = uint16_t(at.quanta[axis] - chunks[chunk].origin[axis]);
                local.flags = at.flags;
                put(record, ChunkArray::Position, &local);
            } else {
                put(record, ChunkArray::Position, position);
            }
            put(record, ChunkArray::SourceIndex, &source_index);
            for (const CopiedArray& copied : kCopiedArrays) {
                const size_t width = layout.stride[uint32_t(copied.array)] / sizeof(float);
                put(record, copied.array, (batch.*copied.values).data() + width * i);
            }
        }
        done += batch.count;
        progress(done);
    });
    regions.finish();
}

} // namespace gsc
