// SPDX-License-Identifier: Apache-2.0
// Records of one chunk -> its payload, groups and leaves.
#pragma once

#include "convert/write/partition.h"
#include <gsc/gsc_layout.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gsc {

struct LeafBuild {
    LeafRecord record; // nanovdb_index not filled in
    uint64_t cells[8]; // occupied cells, bit z of byte y of word x, as OpenVDB's leaf masks have them
};

// `chunk` holds its place (level_index, anchor_count, anchor_first, group_first, group_count, origin, payload_*);
// the rest is filled in. `records`: the chunk's records in source order. `payload`: payload_bytes zeros.
// `groups`: the chunk's group_count records. `index` (source index -> anchor) gets the chunk's entries.
void buildChunk(const ModelParams& params, const LevelRecord& level, uint32_t chunk_index,
                std::span<const std::byte> records, ChunkRecord& chunk, std::span<std::byte> payload,
                std::span<GroupRecord> groups, std::vector<LeafBuild>& leaves, std::span<uint32_t> index);

} // namespace gsc
