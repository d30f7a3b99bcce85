// SPDX-License-Identifier: Apache-2.0
// The archive profile of a .gsc file. This header is normative together with schemas/gsc.md, section 10.
//
//   [FileHeader, profile 1][SectionEntry x 2]---[DATA]---[PART]---
//
//   An archive stands for one runtime file, whose bytes can be restored from it. The runtime file is cut into parts:
// its header and table,
//   each section but ANCH, each chunk payload. Bytes between the parts are zero. PART lists the parts in the order of
//   their bytes, DATA holds them one behind the other: the streams' records, then the streams' bytes.
#pragma once

#include <gsc/gsc_layout.h>

#include <cstddef>
#include <cstdint>
#include <type_traits>

namespace gsc {

constexpr uint32_t kSectionParts = fourCc("PART"); // section: ArchiveHeader, then ArchivePart x part_count
constexpr uint32_t kSectionData = fourCc("DATA");  // name of the section that holds the parts as they are stored
// type of the part that holds the runtime file's header and section table
constexpr uint32_t kArchiveFront = fourCc("HEAD");

// A part may not claim more raw bytes than this many times its stored bytes, plus kFreeExpansion bytes: so the memory
// that a reader takes is in proportion to the file.
constexpr uint64_t kMaxExpansion = 4096;
constexpr uint64_t kFreeExpansion = 1 << 20;

// Tells how a stream is stored. A retired number is never used again.
enum class Codec : uint16_t {
    Raw = 0,  // the bytes as they are, not compressed
    Zstd = 1, // byte planes (splitPlanes()) in one Zstandard frame
    // Grid positions and source indices of a chunk, from the first byte of the one array to the last of the other.
    // Stored are an OrderedHeader and three pieces, each coded as Zstd does, or raw where its size is its raw size: the
    // Morton keys of `local` as 64-bit integers, ascending, the first and then the differences; the position flags; the
    // source indices. Flags and source indices are in the order of (key, source index). A decoder sorts the anchors by
    // (key >> 3 cell_log2, source index), which is their order in the chunk.
    Morton = 2,
    Inverse = 3, // INDX: nothing is stored, for it follows from the source indices of all chunks
    // Floats that are multiples of a power of two (step), which the values of a span share. Stored are a StepsHeader
    // and up to six pieces, each coded as Zstd does, or raw where its size is its raw size. First an exponent per span,
    // as signed bytes, kNoStep where all values of the span are zero or masked. Then masks: a bit for every three
    // values, from the lowest bit on, set where all three are kMaskedOffset. Then planes of bytes, the lowest first, of
    // every value that is not masked and whose span has a step; the values are sorted by the exponent of their span,
    // the least first, then by place. A number 2 s in the planes stands for s steps, 2 s - 1 for -s steps.
    Steps = 4,
};

struct ArchiveHeader {
    uint64_t raw_bytes;   // byte 0: size of the runtime file, multiple of kSectionAlign
    uint32_t part_count;  // byte 8: number of ArchivePart records behind this header
    uint32_t reserved0;   // byte 12: zero
    uint64_t reserved[6]; // byte 16: zero
};
static_assert(sizeof(ArchiveHeader) == 64 && std::is_trivially_copyable_v<ArchiveHeader>);

struct ArchivePart {
    uint32_t type;         // byte 0: type of the section that the part lies in, or kArchiveFront
    uint32_t stream_count; // byte 4: number of streams, 1..kMaxStreams
    uint64_t raw_offset;   // byte 8: place of the part in the runtime file, multiple of kPayloadAlign
    uint64_t raw_bytes;    // byte 16: size of the part in the runtime file
    uint64_t offset;       // byte 24: place in DATA, right behind the part before
    uint64_t bytes;        // byte 32: size of the stored part in DATA
    uint64_t raw_checksum; // byte 40: XXH3-64 of the part's raw bytes
    uint64_t checksum;     // byte 48: XXH3-64 of the part's stored bytes
    uint64_t first_anchor; // byte 56: first anchor of a chunk payload, else 0
};
static_assert(sizeof(ArchivePart) == 64 && offsetof(ArchivePart, checksum) == 48);
static_assert(std::is_trivially_copyable_v<ArchivePart>);

constexpr uint32_t kMaxStreams = 16;

struct ArchiveStream {
    uint16_t codec;     // byte 0: a value of Codec
    uint16_t element;   // byte 2: bytes of a value: 1, 2, 4 or 8
    uint32_t columns;   // byte 4: values of a record, 1..65536; for Morton: number of anchors
    uint32_t cell_log2; // byte 8: LevelRecord::cell_log2 for Morton, else 0
    uint32_t sources;   // byte 12: number of source indices at the end of the raw bytes, which Inverse reads
    // byte 16: place of the stream in the part; the streams of a part ascend without overlap, bytes between them are
    // zero
    uint64_t raw_offset;
    uint64_t raw_bytes; // byte 24: size in the part
    uint64_t bytes;     // byte 32: stored size of the stream
};
static_assert(sizeof(ArchiveStream) == 40 && std::is_trivially_copyable_v<ArchiveStream>);

constexpr uint32_t kMostStepPlanes = 3;
constexpr int8_t kNoStep = -128; // exponent of a span without a step; other exponents are -126..127

struct StepsHeader {
    uint32_t span;           // byte 0: number of values that share an exponent, divides the stream's columns
    uint32_t masks;          // byte 4: 1 if masks are stored (columns are then a multiple of 3), else 0
    uint32_t planes;         // byte 8: number of planes, 0..kMostStepPlanes
    uint32_t reserved;       // byte 12: zero
    uint64_t exponent_bytes; // byte 16: stored size of the exponents
    uint64_t mask_bytes;     // byte 24: stored size of the masks
    uint64_t plane_bytes[kMostStepPlanes]; // byte 32: stored size of each plane
};
static_assert(sizeof(StepsHeader) == 56 && std::is_trivially_copyable_v<StepsHeader>);

struct OrderedHeader {
    uint64_t key_bytes;    // byte 0: stored size of the keys
    uint64_t flag_bytes;   // byte 8: stored size of the flags
    uint64_t source_bytes; // byte 16: stored size of the source indices
};
static_assert(sizeof(OrderedHeader) == 24 && std::is_trivially_copyable_v<OrderedHeader>);

} // namespace gsc
