// SPDX-License-Identifier: Apache-2.0
// Decides where every anchor goes in the file: the grids, the cell size of each level, the chunks and how many anchors
// each holds.
#pragma once

#include "convert/write/scan.h"
#include <gsc/gsc_layout.h>

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace gsc {

// Record of a level, with all fields that are known before the chunks are built.
struct LevelPlan : LevelRecord {
    std::vector<uint64_t> keys; // one per chunk, ascending: mortonKey() of the finest node >> 3 * cell_log2
};

struct Partition {
    PositionEncoding encoding = PositionEncoding::Grid;
    Grid grid; // voxel_size is 0 if positions are stored as floats
    std::vector<LevelPlan> levels;
    std::vector<ChunkRecord> chunks; // in the order of the file; level_index, anchor_count and origin are set
    std::vector<std::string> warnings;

    [[nodiscard]] uint32_t levelIndex(int32_t level) const; // index in `levels` of a level that the scan found
};

// Plans the file; reads the positions and levels two times or more. `checkpoint` gives known facts of the grid. Throws
// Error(InvalidFile) if there are more levels than a file can hold.
Partition planPartition(AnchorSource& source, ScanResult& scan, const Checkpoint& checkpoint, uint64_t chunk_anchors,
                        const std::function<void(uint64_t)>& progress);

// A position in quanta of its level: exact if positions are on a grid, else the cube of one quantum that it lies in.
// Precondition: the partition was planned with this position.
struct QuantaPosition {
    int32_t quanta[3];
    uint16_t flags; // bit mask of GridPositionFlags
};
[[nodiscard]] QuantaPosition placeAnchor(PositionEncoding encoding, const LevelRecord& level, const float position[3]);

// Finds the chunk of an anchor. It remembers the last one, because neighbours in a checkpoint are often neighbours in
// space.
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
