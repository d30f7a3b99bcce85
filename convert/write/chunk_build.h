// SPDX-License-Identifier: Apache-2.0
// Makes the payload, the groups and the leaves of a chunk from its records.
#pragma once

#include "convert/write/partition.h"
#include <gsc/gsc_layout.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gsc {

struct LeafBuild {
    LeafRecord record; // all but nanovdb_index, which buildNanoVdb() sets
    uint64_t cells[8]; // occupied cells of the leaf: bit z of byte y of word x, as in OpenVDB's masks
};

// `chunk` must have its place set (level_index, anchor_count, anchor_first, group_first, group_count, origin,
// payload_*); its other fields are set here. `records`: the records of the chunk in the order of the source. `payload`:
// payload_bytes bytes, all zero. `groups`: the group_count records of the chunk. `index`: for each source index the
// number of the anchor; the entries of this chunk are set.
void buildChunk(const ModelParams& params, const LevelRecord& level, uint32_t chunk_index,
                std::span<const std::byte> records, ChunkRecord& chunk, std::span<std::byte> payload,
                std::span<GroupRecord> groups, std::vector<LeafBuild>& leaves, std::span<uint32_t> index);

} // namespace gsc
