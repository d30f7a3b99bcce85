// SPDX-License-Identifier: Apache-2.0
// A .gsc file as typed spans into its bytes, zero copy. Nothing in the file is trusted.
#pragma once

#include <gsc/gsc_layout.h>
#include <gsc/gsc_status.h>

#include <cstddef>
#include <span>
#include <string_view>

namespace gsc {

// Valid as long as the bytes are. Every span lies inside the file and holds as many records as its count says.
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
    std::span<const uint32_t> index;                // source index -> anchor
    std::span<const AnchorSensitivity> sensitivity; // per anchor, empty if the file has none
    const TileRecord* tile = nullptr;               // null if the file was not cut from another
    std::span<const uint32_t> tile_rows;            // source index -> that of the other file
    std::span<const MlpRecord> mlps;
    std::span<const std::byte> weights; // whole MLPW section
    std::span<const std::byte> packed;  // whole MLPP section
    std::span<const uint32_t> embedding_rows;
    std::span<const float> embedding; // rows x appearance_dim
    std::span<const CameraRecord> cameras;
    std::string_view camera_names;
    std::span<const std::byte> anchors;
};

enum class GscCheck {
    Index, // header, table, checksums and records of every section but ANCH: what a player needs to be safe
    Full,  // Index, and the checksum and content of every chunk payload
};

// Opens `file` (aligned to 8 bytes, as a mapping is). Reports every problem to `sink`, which may be null, but at most
// 16 of one id; true if there was no Error or Fatal, and then every index in `view` that another array is addressed
// with is in range.
// Throws Error(Interrupted) between chunks of a full check, where the program asks for that (interrupt.h).
bool openGsc(std::span<const std::byte> file, GscView& view, GscCheck check, const IssueSink& sink);

// Header, table, META, PARM and LEVL only: what `gsc info` needs, without touching the rest of the mapping.
bool openGscSummary(std::span<const std::byte> file, GscView& view, const IssueSink& sink);

// Bytes of a chunk's payload. Precondition: `view` came from openGsc() without errors.
std::span<const std::byte> chunkPayload(const GscView& view, const ChunkRecord& chunk);

} // namespace gsc
