// SPDX-License-Identifier: Apache-2.0
// Source of `gsc sample replicate` in a real aerial model: the part of the ground that photographs cover well.
#pragma once

#include "convert/input/checkpoint.h"
#include "convert/survey/ground_frame.h"

#include <cstdint>
#include <vector>

namespace gsc {

// An anchor of the tile: its row as the PLY holds it, and its place on the grid.
struct TileAnchor {
    int32_t level = 0;
    int32_t quanta[3] = {};
};

struct ReplicateSource {
    GroundFrame frame;
    uint32_t row_floats = 0;
    bool octree = false;
    std::vector<float> quantum; // per level
    float origin = 0;
    std::vector<float> rows; // row_floats each, as upstream orders the columns; the anchors of one tile
    std::vector<TileAnchor> anchors;
};

// Throws Error: Usage (no cameras, too few of them, nothing is seen well), Unsupported (positions off the grid).
ReplicateSource readReplicateSource(const Checkpoint& checkpoint);

} // namespace gsc
