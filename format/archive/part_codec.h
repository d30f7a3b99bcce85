// SPDX-License-Identifier: Apache-2.0
// Encodes parts of a runtime file into the streams of an archive (archive_layout.h), and decodes them.
#pragma once

#include "format/archive/codec.h"
#include <gsc/gsc_reader.h>

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

namespace gsc {

struct RawPart {
    uint32_t type;         // type of the section that the part lies in, as ArchivePart::type
    uint64_t raw_offset;   // place of the part in the runtime file, in bytes
    uint64_t first_anchor; // first anchor of a chunk payload, as ArchivePart::first_anchor
    size_t chunk;          // index of the chunk whose payload this is
    std::span<const std::byte> bytes;
};

struct StoredPart {
    ArchivePart record{}; // record of the part, complete but for its `offset`
    std::vector<std::byte> bytes;
};

// Cuts a runtime file into parts, in the order of their bytes. Precondition: `view` came from openGsc() on `file`
// without errors.
[[nodiscard]] std::vector<RawPart> cutIntoParts(std::span<const std::byte> file, const GscView& view);

// Encodes parts, one at a time; each thread needs an object of its own.
class PartEncoder {
public:
    // `level` is the compression level of Zstandard. `view` came from openGsc() without errors and must live longer
    // than this object.
    PartEncoder(const GscView& view, int level);

    // Encodes `part` and decodes the result as a test. Where that does not give back the bytes, because the file was
    // not written by a bake, a simpler codec stores the part.
    [[nodiscard]] StoredPart encode(const RawPart& part);

private:
    struct Stream {
        ArchiveStream record;
        std::vector<std::byte> bytes;
    };

    void add(std::vector<Stream>& streams, const RawPart& part, uint64_t offset, uint64_t bytes, uint32_t element,
             uint32_t columns);
    bool addOrdered(std::vector<Stream>& streams, const RawPart& part, uint32_t anchors, uint32_t cell_log2,
                    uint64_t sources_at);
    void trySteps(Stream& stream, const RawPart& part, ChunkArray array);
    void addChunk(std::vector<Stream>& streams, const RawPart& part, bool ordered);
    [[nodiscard]] std::vector<Stream> streamsOf(const RawPart& part, bool ordered);
    [[nodiscard]] StoredPart assemble(const RawPart& part, const std::vector<Stream>& streams) const;
    [[nodiscard]] bool givesBack(const RawPart& part, const StoredPart& stored);

    const GscView& m_view;
    Coder m_coder;
    std::vector<std::byte> m_check;
};

struct SourceArray { // place of a chunk's source indices in a runtime file: byte offset, number of indices
    uint64_t offset, count;
    uint64_t first_anchor;
};

enum class PartFault { None, Streams, UnknownCodec, MissingCodec, Content };

// Decodes parts, one at a time; each thread needs an object of its own.
class PartDecoder {
public:
    // Decodes `stored` into `out`, which has record.raw_bytes bytes, all zero. A part coded as Inverse stays zero:
    // invertSources() fills it later. The content is not compared with record.raw_checksum.
    PartFault decode(const ArchivePart& record, std::span<const std::byte> stored, std::span<std::byte> out);

    // the codec that could not be decoded, after UnknownCodec or MissingCodec
    [[nodiscard]] Codec faultCodec() const { return m_codec; }
    // isInverse() and sources() describe the part of the last call of decode().
    [[nodiscard]] bool isInverse() const { return m_is_inverse; } // true if invertSources() must fill the part
    [[nodiscard]] const std::optional<SourceArray>& sources() const { return m_sources; }

private:
    PartFault decodeStream(const ArchiveStream& stream, std::span<const std::byte> stored, std::span<std::byte> out);
    bool decodeOrdered(const ArchiveStream& stream, std::span<const std::byte> stored, std::span<std::byte> out);

    Coder m_coder;
    Codec m_codec = Codec::Raw;
    bool m_is_inverse = false;
    std::optional<SourceArray> m_sources;
};

// Computes the INDX section from the source indices that lie in the bytes of `file`; the bytes of INDX are written to
// `index`. Returns false if a source index is not below the number of entries of INDX; `index` is then of no use.
bool invertSources(std::span<const std::byte> file, std::span<const SourceArray> sources, std::span<std::byte> index);

} // namespace gsc
