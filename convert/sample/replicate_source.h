// SPDX-License-Identifier: Apache-2.0
// What `gsc sample replicate` takes from a real aerial model: the part of the ground that photographs cover well.
#pragma once

#include "convert/input/checkpoint.h"
#include "convert/sample/vec3.h"

#include <cstdint>
#include <vector>

namespace gsc {

// The ground of an aerial model. The plane is spanned by the two larger principal axes of the anchors that at least
// kMinViews training cameras see; `up` is the third axis, turned to the side of the cameras. Its height is the median
// of those anchors, the capture height the median of the training cameras above it.
struct GroundFrame {
    Vec3 axis[2], up;                      // unit vectors, right-handed
    double ground = 0, capture_height = 0; // along up
    double low[2] = {}, high[2] = {};      // 10 and 90 % of the well-seen anchors along the axes
};

constexpr uint32_t kMinViews = 6;
constexpr double kHighestShare = 0.35; // of the capture height, above ground: kites, masts and stray points stay out

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
