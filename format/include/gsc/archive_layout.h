// SPDX-License-Identifier: Apache-2.0
// The archive profile of a .gsc file. This header is normative together with schemas/gsc.md, section 10.
//
//   [FileHeader, profile 1][SectionEntry x 2]---[DATA]---[PART]---
//
//   An archive stands for one runtime file and gives its bytes back. That file is cut into parts: its header and table,
//   each section but ANCH, each chunk payload. Bytes between the parts are zero. PART lists the parts in the order of
//   their bytes, DATA holds them one behind the other: the streams' records, then the streams' bytes.
#pragma once

#include <gsc/gsc_layout.h>

#include <cstddef>
#include <cstdint>
#include <type_traits>

namespace gsc {

constexpr uint32_t kSectionParts = fourCc("PART"); // ArchiveHeader, then ArchivePart x part_count
constexpr uint32_t kSectionData = fourCc("DATA");  // the parts as they are stored
constexpr uint32_t kArchiveFront = fourCc("HEAD"); // type of the part that holds header and table

// A part may not stand for more than this many times its stored bytes, plus this many bytes: so a reader's memory is in
// proportion to the file.
constexpr uint64_t kMaxExpansion = 4096;
constexpr uint64_t kFreeExpansion = 1 << 20;

// How a stream is stored. Numbers are never used again for something else.
enum class Codec : uint16_t {
    Raw = 0,  // not compressed
    Zstd = 1, // byte planes (splitPlanes()), one Zstandard frame
    // Grid positions and source indices of a chunk, from the first byte of the one array to the last of the other:
    // OrderedHeader, then three pieces coded as Zstd does, or raw where one has its raw size. The Morton keys of `local`
    // as 64-bit integers, ascending, the first and then the differences; and in the order of (key, source index) the
    // position flags and the source indices. Anchors are in the order of (key >> 3 cell_log2, source index) again.
    Morton = 2,
    Inverse = 3, // INDX: nothing is stored, it follows from the source indices of all chunks
    // Floats that are multiples of a power of two, which the values of a span share: StepsHeader, then up to six pieces,
    // coded as Zstd does, or raw where one has its raw size. An exponent per span, as signed bytes, kNoStep where all of its
    // values are zero or masked; a bit for every three values, from the lowest on, set where all are kMaskedOffset; and
    // planes of bytes, the lowest first, of every value of a span with a step that is not masked. Those lie by the
    // exponent of their spans, the least first, then by their place. A plane's value of 2 s stands for s steps, of
    // 2 s - 1 for -s.
    Steps = 4,
};

struct ArchiveHeader {
    uint64_t raw_bytes;   // 0   of the runtime file, multiple of kSectionAlign
    uint32_t part_count;  // 8
    uint32_t reserved0;   // 12  zero
    uint64_t reserved[6]; // 16  zero
};
static_assert(sizeof(ArchiveHeader) == 64 && std::is_trivially_copyable_v<ArchiveHeader>);

struct ArchivePart {
    uint32_t type;         // 0   of the section it lies in, or kArchiveFront
    uint32_t stream_count; // 4   1..kMaxStreams
    uint64_t raw_offset;   // 8   in the runtime file, multiple of kPayloadAlign
    uint64_t raw_bytes;    // 16
    uint64_t offset;       // 24  in DATA, right behind the part before
    uint64_t bytes;        // 32
    uint64_t raw_checksum; // 40  XXH3-64 of the raw bytes
    uint64_t checksum;     // 48  XXH3-64 of the stored bytes
    uint64_t first_anchor; // 56  of a chunk payload, else 0
};
static_assert(sizeof(ArchivePart) == 64 && offsetof(ArchivePart, checksum) == 48);
static_assert(std::is_trivially_copyable_v<ArchivePart>);

constexpr uint32_t kMaxStreams = 16;

struct ArchiveStream {
    uint16_t codec;      // 0   Codec
    uint16_t element;    // 2   bytes of a value: 1, 2, 4 or 8
    uint32_t columns;    // 4   values of a record, 1..65536; of Morton: anchors
    uint32_t cell_log2;  // 8   of Morton, else 0
    uint32_t sources;    // 12  source indices that end the raw bytes: Inverse reads them
    uint64_t raw_offset; // 16  in the part; the streams of a part ascend without overlap, zero lies between them
    uint64_t raw_bytes;  // 24
    uint64_t bytes;      // 32  stored
};
static_assert(sizeof(ArchiveStream) == 40 && std::is_trivially_copyable_v<ArchiveStream>);

constexpr uint32_t kMostStepPlanes = 3;
constexpr int8_t kNoStep = -128; // else -126..127

struct StepsHeader {
    uint32_t span;                         // 0   values that share an exponent: divides the stream's columns
    uint32_t masks;                        // 4   1: there are masks, and columns are a multiple of 3; else 0
    uint32_t planes;                       // 8   0..kMostStepPlanes
    uint32_t reserved;                     // 12  zero
    uint64_t exponent_bytes;               // 16
    uint64_t mask_bytes;                   // 24
    uint64_t plane_bytes[kMostStepPlanes]; // 32
};
static_assert(sizeof(StepsHeader) == 56 && std::is_trivially_copyable_v<StepsHeader>);

struct OrderedHeader {
    uint64_t key_bytes;    // 0
    uint64_t flag_bytes;   // 8
    uint64_t source_bytes; // 16
};
static_assert(sizeof(OrderedHeader) == 24 && std::is_trivially_copyable_v<OrderedHeader>);

} // namespace gsc
