// SPDX-License-Identifier: Apache-2.0
// Reads a .gsc file as typed spans into its bytes, without a copy. No value in the file is trusted.
#pragma once

#include <gsc/gsc_layout.h>
#include <gsc/gsc_status.h>

#include <cstddef>
#include <span>
#include <string_view>

namespace gsc {

// Sections of an opened file, valid as long as its bytes are. Every span lies inside the file and holds as many records
// as its count says.
struct GscView {
    const FileHeader* header = nullptr;
    std::span<const SectionEntry> sections;
    std::string_view manifest;
    const ModelParams* params = nullptr;
    std::span<const LevelRecord> levels;
    std::span<const ChunkRecord> chunks;
    std::span<const GroupRecord> groups;
    std::span<const LeafRecord> leaves;
    std::span<const std::byte> nanovdb;
    std::span<const uint32_t> index;                // number of the anchor for each source index
    std::span<const AnchorSensitivity> sensitivity; // one per anchor, empty if the file has no SENS
    const TileRecord* tile = nullptr;               // null if the file is no tile of another file
    std::span<const uint32_t> tile_rows; // for each source index of this file, the source index in the whole file
    std::span<const MlpRecord> mlps;
    std::span<const std::byte> weights; // content of the section MLPW
    std::span<const std::byte> packed;  // content of the section MLPP
    std::span<const uint32_t> embedding_rows;
    std::span<const float> embedding; // rows of the appearance embedding: appearance_rows x appearance_dim values
    std::span<const CameraRecord> cameras;
    std::string_view camera_names;
    std::span<const std::byte> anchors;
};

enum class GscCheck {
    Index, // checks header, table, checksums and records of every section but ANCH: a player is then safe
    Full,  // checks all of Index, and the checksum and content of every chunk payload
};

// Opens `file`, which is aligned to 8 bytes, as a mapping is. Reports every problem to `sink`, which may be null, but
// at most 16 of one id. Returns true if no problem was an Error or Fatal; every index in `view` that addresses another
// array is then in range. Throws Error(Interrupted) between the chunks of a full check if the user interrupts the
// program (interrupt.h).
bool openGsc(std::span<const std::byte> file, GscView& view, GscCheck check, const IssueSink& sink);

// Opens header, table, META, PARM and LEVL only, all that `gsc info` needs; the other bytes of the mapping are not
// read.
bool openGscSummary(std::span<const std::byte> file, GscView& view, const IssueSink& sink);

// Bytes of a chunk's payload. Precondition: `view` came from openGsc() without errors.
std::span<const std::byte> chunkPayload(const GscView& view, const ChunkRecord& chunk);

} // namespace gsc
