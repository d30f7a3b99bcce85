// SPDX-License-Identifier: Apache-2.0
// Content of a file at a point of the world, level by level: down the tree that every file carries.
#pragma once

#include <gsc/gsc_reader.h>

#include <array>
#include <optional>
#include <vector>

namespace gsc {

struct NearestAnchor {
    uint32_t anchor, source; // index in the file; row in the checkpoint
    uint32_t chunk, group;
    std::array<float, 3> position; // world units, as trained
    double distance;               // from the point, world units
};

struct PlaceInLevel {
    uint32_t level_index;
    // voxel of the level's grid; none outside the range that a grid can number
    std::optional<std::array<int32_t, 3>> voxel;
    std::optional<uint32_t> chunk, leaf;       // CHNK and LEAF records, where the tree has nodes there
    uint32_t group_first = 0, group_count = 0; // groups of the leaf's anchors
    bool occupied = false;                     // the grid has the voxel
    uint32_t anchors_in_voxel = 0;
    std::optional<NearestAnchor> nearest; // nearest anchor of the whole level; none if no position is a number
};

// In the order of view.levels. `point` is finite, in world units as the trainers have them. Precondition: `view` came from
// openGsc() without errors. A grid that cannot be walked is reported to `sink` and ends the list.
std::vector<PlaceInLevel> locate(const GscView& view, const std::array<double, 3>& point, const IssueSink& sink);

} // namespace gsc
