// SPDX-License-Identifier: Apache-2.0
// Reads the part of a real aerial model that `gsc sample replicate` repeats: the ground that photographs cover well.
#pragma once

#include "convert/input/checkpoint.h"
#include "convert/survey/ground_frame.h"

#include <cstdint>
#include <vector>

namespace gsc {

// An anchor of the part that is repeated: its row as in the PLY, and its position on the grid.
struct TileAnchor {
    int32_t level = 0;
    int32_t quanta[3] = {};
};

struct ReplicateSource {
    GroundFrame frame;
    uint32_t row_floats = 0;
    bool octree = false;
    std::vector<float> quantum; // edge of a voxel in world units, per level
    float origin = 0;
    std::vector<float> rows; // row_floats values per anchor, in the column order of the PLY
    std::vector<TileAnchor> anchors;
};

// Reads the part to be repeated. Throws Error: Usage (no cameras, too few, or nothing is seen well), Unsupported
// (positions that are not on a grid).
ReplicateSource readReplicateSource(const Checkpoint& checkpoint);

} // namespace gsc
