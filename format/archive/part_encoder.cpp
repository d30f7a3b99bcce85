// SPDX-License-Identifier: Apache-2.0
#include "format/archive/part_codec.h"

#include "format/archive/ordered_positions.h"
#include "format/archive/steps.h"
#include <gsc/checksum.h>

#include <algorithm>
#include <cstring>

namespace gsc {

namespace {

struct Shape {
    uint32_t element, columns;
};

// Size and number of the values in a record of the section, so that values of one kind form a column.
Shape sectionShape(uint32_t type)
{
    switch (type) {
    case kSectionParams:
    case kSectionWeights:
    case kSectionPacked:
    case kSectionEmbedding:
    case kSectionIndex:
    case kSectionTile:
        return {4, 1};
    case kSectionLevels:
        return {4, sizeof(LevelRecord) / 4};
    case kSectionChunks:
        return {4, sizeof(ChunkRecord) / 4};
    case kSectionGroups:
        return {4, sizeof(GroupRecord) / 4};
    case kSectionLeaves:
        return {4, sizeof(LeafRecord) / 4};
    case kSectionSensitivity:
        return {2, 2};
    case kSectionCameras:
        return {8, sizeof(CameraRecord) / 8};
    default:
        return {1, 1};
    }
}

Shape arrayShape(const ModelParams& params, ChunkArray array, uint64_t stride)
{
    if (array == ChunkArray::Position && params.position_encoding == uint32_t(PositionEncoding::Grid))
        return {2, 4};
    return {4, uint32_t(stride / 4)};
}

template <typename T>
std::span<const std::byte> bytesOf(const std::vector<T>& values)
{
    return std::as_bytes(std::span(values));
}

} // namespace

std::vector<RawPart> cutIntoParts(std::span<const std::byte> file, const GscView& view)
{
    std::vector<RawPart> parts;
    parts.push_back(
        {kArchiveFront, 0, 0, 0, file.first(sizeof(FileHeader) + view.sections.size() * sizeof(SectionEntry))});
    for (const SectionEntry& entry : view.sections) {
        const auto content = file.subspan(size_t(entry.offset), size_t(entry.bytes));
        if (entry.type != kSectionAnchors) {
            if (!content.empty())
                parts.push_back({entry.type, entry.offset, 0, 0, content});
            continue;
        }
        for (size_t i = 0; i < view.chunks.size(); ++i) {
            const ChunkRecord& chunk = view.chunks[i];
            parts.push_back(
                {entry.type, entry.offset + chunk.payload_offset, chunk.anchor_first, i, chunkPayload(view, chunk)});
        }
    }
    return parts;
}

PartEncoder::PartEncoder(const GscView& view, int level) : m_view(view), m_coder(level) {}

void PartEncoder::add(std::vector<Stream>& streams, const RawPart& part, uint64_t offset, uint64_t bytes,
                      uint32_t element, uint32_t columns)
{
    const uint64_t record = uint64_t(element) * columns, whole = bytes / record * record;
    if (whole > 0) {
        Stream stream{};
        const bool zstd =
            m_coder.encode(part.bytes.subspan(size_t(offset), size_t(whole)), element, columns, stream.bytes);
        stream.record = {uint16_t(zstd ? Codec::Zstd : Codec::Raw),
                         uint16_t(element),
                         columns,
                         0,
                         0,
                         offset,
                         whole,
                         stream.bytes.size()};
        streams.push_back(std::move(stream));
    }
    if (whole < bytes)
        add(streams, part, offset + whole, bytes - whole, 1, 1);
}

bool PartEncoder::addOrdered(std::vector<Stream>& streams, const RawPart& part, uint32_t anchors, uint32_t cell_log2,
                             uint64_t sources_at)
{
    OrderedPositions ordered;
    const auto* const positions = reinterpret_cast<const GridPosition*>(part.bytes.data());
    const auto* const sources = reinterpret_cast<const uint32_t*>(part.bytes.data() + sources_at);
    if (!orderPositions({positions, anchors}, {sources, anchors}, cell_log2, ordered))
        return false;
    OrderedHeader header{};
    Stream stream{};
    stream.bytes.resize(sizeof(header));
    auto sinceLast = [&, last = stream.bytes.size()]() mutable {
        const uint64_t bytes = stream.bytes.size() - last;
        last = stream.bytes.size();
        return bytes;
    };
    for (size_t i = anchors; i-- > 1;)
        ordered.keys[i] -= ordered.keys[i - 1];
    m_coder.encode(bytesOf(ordered.keys), 8, 1, stream.bytes);
    header.key_bytes = sinceLast();
    m_coder.encode(bytesOf(ordered.flags), 2, 1, stream.bytes);
    header.flag_bytes = sinceLast();
    m_coder.encode(bytesOf(ordered.sources), 4, 1, stream.bytes);
    header.source_bytes = sinceLast();
    std::memcpy(stream.bytes.data(), &header, sizeof(header));
    stream.record = {
        uint16_t(Codec::Morton), 1, anchors, cell_log2, anchors, 0, sources_at + sizeof(uint32_t) * uint64_t(anchors),
        stream.bytes.size()};
    streams.push_back(std::move(stream));
    return true;
}

// Encodes the stream of an array with codec Steps where that is smaller.
void PartEncoder::trySteps(Stream& stream, const RawPart& part, ChunkArray array)
{
    // all offsets of an anchor share one step, and so do all its features; of its 6 scales, the 3 of the offsets share
    // one and the 3 of the Gaussians another
    const uint32_t columns = stream.record.columns;
    const bool masks = array == ChunkArray::Offset && (m_view.params->flags & kModelMaskedSlots) != 0;
    const uint32_t span = array == ChunkArray::Scale ? 3 : columns;
    if (array != ChunkArray::Scale && array != ChunkArray::Offset && array != ChunkArray::Feature)
        return;
    std::vector<std::byte> steps;
    const auto raw = part.bytes.subspan(size_t(stream.record.raw_offset), size_t(stream.record.raw_bytes));
    if (!encodeSteps(raw, columns, span, masks, m_coder, steps) || steps.size() >= stream.bytes.size())
        return;
    stream.record.codec = uint16_t(Codec::Steps);
    stream.record.bytes = steps.size();
    stream.bytes = std::move(steps);
}

void PartEncoder::addChunk(std::vector<Stream>& streams, const RawPart& part, bool ordered)
{
    const ChunkRecord& chunk = m_view.chunks[part.chunk];
    const ModelParams& params = *m_view.params;
    const ChunkArrayLayout layout = chunkArrayLayout(params, chunk.anchor_count);
    const uint32_t sources = uint32_t(ChunkArray::SourceIndex);
    uint32_t array = 0;
    if (ordered && params.position_encoding == uint32_t(PositionEncoding::Grid) &&
        addOrdered(streams, part, chunk.anchor_count, m_view.levels[chunk.level_index].cell_log2,
                   layout.offset[sources]))
        array = sources + 1;
    for (; array < uint32_t(ChunkArray::Count); ++array) {
        const uint64_t stride = layout.stride[array];
        if (stride == 0)
            continue;
        const Shape shape = arrayShape(params, ChunkArray(array), stride);
        add(streams, part, layout.offset[array], stride * chunk.anchor_count, shape.element, shape.columns);
        if (ordered)
            trySteps(streams.back(), part, ChunkArray(array));
        if (array == sources)
            streams.back().record.sources = chunk.anchor_count;
    }
}

std::vector<PartEncoder::Stream> PartEncoder::streamsOf(const RawPart& part, bool ordered)
{
    std::vector<Stream> streams;
    if (part.type == kSectionAnchors) {
        addChunk(streams, part, ordered);
    } else if (part.type == kSectionIndex && ordered) {
        Stream stream{};
        stream.record = {uint16_t(Codec::Inverse), 1, 1, 0, 0, 0, part.bytes.size(), 0};
        streams.push_back(std::move(stream));
    } else {
        const Shape shape = sectionShape(part.type);
        add(streams, part, 0, part.bytes.size(), shape.element, shape.columns);
    }
    return streams;
}

StoredPart PartEncoder::assemble(const RawPart& part, const std::vector<Stream>& streams) const
{
    StoredPart stored;
    for (const Stream& stream : streams) {
        const auto record = std::as_bytes(std::span(&stream.record, 1));
        stored.bytes.insert(stored.bytes.end(), record.begin(), record.end());
    }
    for (const Stream& stream : streams)
        stored.bytes.insert(stored.bytes.end(), stream.bytes.begin(), stream.bytes.end());
    stored.record.type = part.type;
    stored.record.stream_count = uint32_t(streams.size());
    stored.record.raw_offset = part.raw_offset;
    stored.record.raw_bytes = part.bytes.size();
    stored.record.bytes = stored.bytes.size();
    stored.record.raw_checksum = checksum64(part.bytes);
    stored.record.checksum = checksum64(stored.bytes);
    stored.record.first_anchor = part.first_anchor;
    return stored;
}

bool PartEncoder::givesBack(const RawPart& part, const StoredPart& stored)
{
    const uint64_t most = stored.bytes.size() * kMaxExpansion + kFreeExpansion;
    PartDecoder decoder;
    m_check.assign(part.bytes.size(), std::byte{0});
    if (stored.record.stream_count > kMaxStreams ||
        decoder.decode(stored.record, stored.bytes, m_check) != PartFault::None)
        return false;
    if (!decoder.isInverse())
        return part.bytes.size() <= most && std::ranges::equal(m_check, part.bytes);
    std::vector<SourceArray> sources;
    for (const ChunkRecord& chunk : m_view.chunks)
        sources.push_back(
            {chunk.payload_offset +
                 chunkArrayLayout(*m_view.params, chunk.anchor_count).offset[uint32_t(ChunkArray::SourceIndex)],
             chunk.anchor_count, chunk.anchor_first});
    return invertSources(m_view.anchors, sources, m_check) && std::ranges::equal(m_check, part.bytes);
}

StoredPart PartEncoder::encode(const RawPart& part)
{
    for (const bool ordered : {true, false}) {
        StoredPart stored = assemble(part, streamsOf(part, ordered));
        if (givesBack(part, stored))
            return stored;
    }
    // stores the part uncompressed; a chunk payload becomes two streams, since INDX is made from the source indices at
    // the end of the first
    uint64_t cut = 0;
    uint32_t anchors = 0;
    if (part.type == kSectionAnchors) {
        anchors = m_view.chunks[part.chunk].anchor_count;
        const ChunkArrayLayout layout = chunkArrayLayout(*m_view.params, anchors);
        cut = layout.offset[uint32_t(ChunkArray::SourceIndex)] + sizeof(uint32_t) * uint64_t(anchors);
    }
    std::vector<Stream> whole;
    const auto addRaw = [&](uint64_t from, uint64_t to, uint32_t sources) {
        if (from == to)
            return;
        const auto bytes = part.bytes.subspan(size_t(from), size_t(to - from));
        whole.push_back(
            {{uint16_t(Codec::Raw), 1, 1, 0, sources, from, bytes.size(), bytes.size()}, {bytes.begin(), bytes.end()}});
    };
    addRaw(0, cut, anchors);
    addRaw(cut, part.bytes.size(), 0);
    return assemble(part, whole);
}

} // namespace gsc
