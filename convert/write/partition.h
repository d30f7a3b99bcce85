// SPDX-License-Identifier: Apache-2.0
// Place of every anchor in the file: the grids, the cell size of each level, its chunks and how many anchors each
// holds.
#pragma once

#include "convert/write/scan.h"
#include <gsc/gsc_layout.h>

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace gsc {

// A level's record as far as it is known before the chunks are built.
struct LevelPlan : LevelRecord {
    std::vector<uint64_t> keys; // mortonKey() of the occupied nodes >> 3 * cell_log2, ascending; a chunk each
};

struct Partition {
    PositionEncoding encoding = PositionEncoding::Grid;
    Grid grid; // voxel_size 0 if the positions are floats
    std::vector<LevelPlan> levels;
    std::vector<ChunkRecord> chunks; // file order; level_index, anchor_count and origin are set
    std::vector<std::string> warnings;

    [[nodiscard]] uint32_t levelIndex(int32_t level) const; // precondition: the scan met the level
};

// Reads the placements two times or more; the checkpoint gives known facts of the grid. Throws Error(InvalidFile) if
// the levels are more than the file can hold.
Partition planPartition(AnchorSource& source, ScanResult& scan, const Checkpoint& checkpoint, uint64_t chunk_anchors,
                        const std::function<void(uint64_t)>& progress);

// Quanta of a position in its level: exact for a grid, the cell it lies in for floats.
// Precondition: the position is one the partition was planned with.
struct QuantaPosition {
    int32_t quanta[3];
    uint16_t flags; // GridPositionFlags
};
[[nodiscard]] QuantaPosition placeAnchor(PositionEncoding encoding, const LevelRecord& level, const float position[3]);

// Finds the chunks of anchors; remembers the last one, since neighbours in a file are often neighbours in space.
class ChunkFinder {
public:
    explicit ChunkFinder(const Partition& partition) : m_partition(partition) {}
    [[nodiscard]] uint32_t find(uint32_t level_index, const QuantaPosition& position);

private:
    const Partition& m_partition;
    uint64_t m_last_key = 0;
    uint32_t m_last_level = ~0u, m_last_chunk = 0;
};

} // namespace gsc
