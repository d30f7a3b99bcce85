// SPDX-License-Identifier: Apache-2.0
// Finds what a file holds at a point of the world, level by level, with the NanoVDB grids in the file.
#pragma once

#include <gsc/gsc_reader.h>

#include <array>
#include <optional>
#include <vector>

namespace gsc {

struct NearestAnchor {
    uint32_t anchor, source; // number of the anchor in the file; number of its row in the checkpoint
    uint32_t chunk, group;
    std::array<float, 3> position; // world units, bit for bit as trained
    double distance;               // distance from the point in world units
};

struct PlaceInLevel {
    uint32_t level_index;
    // Voxel of the level's grid at the point; none beyond the voxel numbers that a grid can have.
    std::optional<std::array<int32_t, 3>> voxel;
    // numbers of the CHNK and the LEAF record at the point; none if the grid has no such node
    std::optional<uint32_t> chunk, leaf;
    uint32_t group_first = 0, group_count = 0; // groups with anchors of that leaf
    bool occupied = false;                     // the grid has this voxel: an anchor lies in its cell
    uint32_t anchors_in_voxel = 0;
    // nearest anchor of the whole level; none if no position of the level is a number
    std::optional<NearestAnchor> nearest;
};

// Finds what each level holds at `point`, in the order of view.levels. `point`: finite, in the model's world units.
// Precondition: `view` came from openGsc() without errors. A grid whose nodes are damaged is reported to `sink` and
// ends the list.
std::vector<PlaceInLevel> locate(const GscView& view, const std::array<double, 3>& point, const IssueSink& sink);

} // namespace gsc
