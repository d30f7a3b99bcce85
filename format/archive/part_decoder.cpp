// SPDX-License-Identifier: Apache-2.0
#include "format/archive/part_codec.h"

#include "format/archive/ordered_positions.h"
#include "format/archive/steps.h"
#include <gsc/byte_view.h>

#include <algorithm>
#include <cstring>

namespace gsc {

namespace {

constexpr uint64_t kMaxColumns = 65536;

// Returns true if the stream's element and column sizes are possible for its codec; called before they are multiplied.
bool isSound(const ArchiveStream& stream, Codec codec)
{
    if (codec == Codec::Morton)
        return stream.element == 1 && stream.cell_log2 <= kMaxCellLog2 && stream.columns == stream.sources &&
               stream.raw_bytes == alignUp(sizeof(GridPosition) * uint64_t(stream.columns), kArrayAlign) +
                                       sizeof(uint32_t) * uint64_t(stream.columns);
    if (codec == Codec::Steps && stream.element != sizeof(float))
        return false;
    const bool element = stream.element == 1 || stream.element == 2 || stream.element == 4 || stream.element == 8;
    return element && stream.columns >= 1 && stream.columns <= kMaxColumns && stream.cell_log2 == 0 &&
           stream.raw_bytes % (uint64_t(stream.element) * stream.columns) == 0 &&
           stream.sources <= stream.raw_bytes / sizeof(uint32_t);
}

} // namespace

PartFault PartDecoder::decode(const ArchivePart& record, std::span<const std::byte> stored, std::span<std::byte> out)
{
    m_is_inverse = false;
    m_sources.reset();
    const ByteView view(stored);
    uint64_t from = uint64_t(record.stream_count) * sizeof(ArchiveStream), to = 0;
    if (record.stream_count < 1 || record.stream_count > kMaxStreams || from > stored.size())
        return PartFault::Streams;
    for (uint32_t i = 0; i < record.stream_count; ++i) {
        const ArchiveStream stream = *view.load<ArchiveStream>(i * sizeof(ArchiveStream));
        const auto bytes = view.slice(from, stream.bytes);
        m_codec = Codec(stream.codec);
        if (stream.codec > uint16_t(Codec::Steps))
            return PartFault::UnknownCodec;
        if (!hasCodec(m_codec))
            return PartFault::MissingCodec;
        if (!bytes || stream.raw_offset < to || stream.raw_offset > out.size() ||
            stream.raw_bytes > out.size() - stream.raw_offset || !isSound(stream, m_codec))
            return PartFault::Streams;
        const auto raw = out.subspan(size_t(stream.raw_offset), size_t(stream.raw_bytes));
        if (const PartFault fault = decodeStream(stream, *bytes, raw); fault != PartFault::None)
            return fault;
        if (stream.sources > 0)
            m_sources = {record.raw_offset + stream.raw_offset + stream.raw_bytes -
                             sizeof(uint32_t) * uint64_t(stream.sources),
                         stream.sources, record.first_anchor};
        to = stream.raw_offset + stream.raw_bytes;
        from += stream.bytes;
    }
    return from == stored.size() ? PartFault::None : PartFault::Streams;
}

PartFault PartDecoder::decodeStream(const ArchiveStream& stream, std::span<const std::byte> stored,
                                    std::span<std::byte> out)
{
    if (m_codec == Codec::Inverse) {
        if (m_is_inverse || !stored.empty())
            return PartFault::Streams;
        m_is_inverse = true;
        return PartFault::None;
    }
    const bool good = m_codec == Codec::Morton  ? decodeOrdered(stream, stored, out)
                      : m_codec == Codec::Steps ? decodeSteps(stored, stream.columns, m_coder, out)
                                                : m_coder.decode(m_codec, stored, stream.element, stream.columns, out);
    return good ? PartFault::None : PartFault::Content;
}

bool PartDecoder::decodeOrdered(const ArchiveStream& stream, std::span<const std::byte> stored,
                                std::span<std::byte> out)
{
    const ByteView view(stored);
    const auto header = view.load<OrderedHeader>(0);
    const uint64_t n = stream.columns;
    const bool aligned = reinterpret_cast<uintptr_t>(out.data()) % alignof(GridPosition) == 0 &&
                         reinterpret_cast<uintptr_t>(out.data() + out.size()) % alignof(uint32_t) == 0;
    if (!header || !aligned || header->key_bytes > stored.size() || header->flag_bytes > stored.size())
        return false;
    const uint64_t flags_at = sizeof(OrderedHeader) + header->key_bytes, sources_at = flags_at + header->flag_bytes;
    const auto keys = view.slice(sizeof(OrderedHeader), header->key_bytes);
    const auto flags = view.slice(flags_at, header->flag_bytes);
    const auto sources = view.slice(sources_at, header->source_bytes);
    if (!keys || !flags || !sources || sources_at + header->source_bytes != stored.size())
        return false;

    OrderedPositions ordered;
    ordered.keys.resize(n);
    ordered.flags.resize(n);
    ordered.sources.resize(n);
    const auto piece = [&](std::span<const std::byte> bytes, uint32_t element, std::span<std::byte> to) {
        return m_coder.decode(bytes.size() == to.size() ? Codec::Raw : Codec::Zstd, bytes, element, 1, to);
    };
    if (!piece(*keys, 8, std::as_writable_bytes(std::span(ordered.keys))))
        return false;
    for (size_t i = 1; i < n; ++i) {
        ordered.keys[i] += ordered.keys[i - 1];
        if (ordered.keys[i] < ordered.keys[i - 1])
            return false;
    }
    if (n > 0 && ordered.keys.back() >> 48 != 0)
        return false;
    if (!piece(*flags, 2, std::as_writable_bytes(std::span(ordered.flags))) ||
        !piece(*sources, 4, std::as_writable_bytes(std::span(ordered.sources))))
        return false;
    restorePositions(ordered, stream.cell_log2, {reinterpret_cast<GridPosition*>(out.data()), size_t(n)},
                     {reinterpret_cast<uint32_t*>(out.data() + out.size() - sizeof(uint32_t) * n), size_t(n)});
    return true;
}

bool invertSources(std::span<const std::byte> file, std::span<const SourceArray> sources, std::span<std::byte> index)
{
    const uint64_t count = index.size() / sizeof(uint32_t);
    for (const SourceArray& array : sources)
        for (uint64_t i = 0; i < array.count; ++i) {
            uint32_t source;
            std::memcpy(&source, file.data() + array.offset + i * sizeof(source), sizeof(source));
            if (source >= count)
                return false;
            const auto anchor = uint32_t(array.first_anchor + i);
            std::memcpy(index.data() + sizeof(uint32_t) * uint64_t(source), &anchor, sizeof(anchor));
        }
    return true;
}

} // namespace gsc
