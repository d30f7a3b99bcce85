// SPDX-License-Identifier: Apache-2.0
// Parts of an archive (archive_layout.h): bytes of a runtime file to streams and back.
#pragma once

#include "format/archive/codec.h"
#include <gsc/gsc_reader.h>

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

namespace gsc {

struct RawPart {
    uint32_t type;         // ArchivePart::type
    uint64_t raw_offset;   // in the runtime file
    uint64_t first_anchor; // ArchivePart::first_anchor
    size_t chunk;          // chunk that the payload belongs to
    std::span<const std::byte> bytes;
};

struct StoredPart {
    ArchivePart record{}; // all but `offset`
    std::vector<std::byte> bytes;
};

// The parts of a runtime file, in the order of their bytes. Precondition: `view` came from openGsc() on `file` without
// errors.
[[nodiscard]] std::vector<RawPart> cutIntoParts(std::span<const std::byte> file, const GscView& view);

// One per thread.
class PartEncoder {
public:
    // `level` is Zstandard's. Precondition of `view` as above; it must outlive this.
    PartEncoder(const GscView& view, int level);

    // Encodes, and tries whether decoding gives back `part`; if not, because a file has it otherwise than a bake writes
    // it, the part is stored without this codec.
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

struct SourceArray { // source indices in the bytes of a runtime file
    uint64_t offset, count;
    uint64_t first_anchor;
};

enum class PartFault { None, Streams, UnknownCodec, MissingCodec, Content };

// One per thread.
class PartDecoder {
public:
    // `stored` -> `out`, which has record.raw_bytes bytes, all zero. A part coded as Inverse is left
    // zero: it follows from other parts. The content is not compared with record.raw_checksum.
    PartFault decode(const ArchivePart& record, std::span<const std::byte> stored, std::span<std::byte> out);

    [[nodiscard]] Codec faultCodec() const { return m_codec; } // codec that UnknownCodec or MissingCodec is about
    // isInverse() and sources() are of the part that decode() was last called for.
    [[nodiscard]] bool isInverse() const { return m_is_inverse; } // invertSources() makes it
    [[nodiscard]] const std::optional<SourceArray>& sources() const { return m_sources; }

private:
    PartFault decodeStream(const ArchiveStream& stream, std::span<const std::byte> stored, std::span<std::byte> out);
    bool decodeOrdered(const ArchiveStream& stream, std::span<const std::byte> stored, std::span<std::byte> out);

    Coder m_coder;
    Codec m_codec = Codec::Raw;
    bool m_is_inverse = false;
    std::optional<SourceArray> m_sources;
};

// INDX from the source indices of a file's bytes, both as they lie there. False where one is not below the number of
// entries: `index` is then of no use.
bool invertSources(std::span<const std::byte> file, std::span<const SourceArray> sources, std::span<std::byte> index);

} // namespace gsc
