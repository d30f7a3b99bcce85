// SPDX-License-Identifier: Apache-2.0
// The voxel grids on which trainers place anchors, and the cells that are in use.
#pragma once

#include "convert/survey/vec3.h"

#include <cstdint>
#include <unordered_set>

namespace gsc {

constexpr uint32_t kMaxSampleLevels = 8;

struct AnchorGrid {
    uint32_t levels = 1;
    float quantum[kMaxSampleLevels] = {}; // edge of a voxel of each level: fl32(voxel_size / 2^level), world units
    float origin = 0;                     // Octree-GS's init_pos; 0 for Scaffold-GS
    double voxel_decimal = 0;             // Scaffold-GS: voxel_size as the decimal number in cfg_args
    int base_layer = 0;                   // Octree-GS's base_layer: how often the box was halved for level 0
};

using GridCell = glm::ivec3;

// Grid with the largest voxel size of the form 1, 2 or 5 x 10^n that is not above `spacing`: a short number in
// cfg_args.
AnchorGrid scaffoldGrid(double spacing);
// Grid as Octree-GS computes it: a box 1.1 times as large as [low, high] is halved base_layer times, until the voxel of
// level 0 is at most `spacing`.
AnchorGrid octreeGrid(float low, float high, double spacing, uint32_t levels);

GridCell cellOf(const AnchorGrid& grid, uint32_t level, dvec3 position);
// Position of a cell, bit for bit as the trainer stores it.
void cellPosition(const AnchorGrid& grid, uint32_t level, const GridCell& cell, float out[3]);

// Cells in use on one tile. A tile has the cells of a box in x and y that shares none with other tiles, so no cell can
// be used on two tiles.
class TakenCells {
public:
    TakenCells(const AnchorGrid& grid, bool bounded, const double min[2], const double max[2]);
    // Returns the free cell nearest to `wanted`, and marks it as used.
    GridCell take(uint32_t level, GridCell wanted);

private:
    struct Key {
        GridCell cell;
        uint32_t level;
        bool operator==(const Key&) const = default;
    };
    struct KeyHash {
        size_t operator()(const Key& key) const;
    };

    [[nodiscard]] GridCell inside(uint32_t level, GridCell cell) const;

    GridCell m_first[kMaxSampleLevels], m_last[kMaxSampleLevels]; // first and last cell of the tile on each level
    std::unordered_set<Key, KeyHash> m_taken;
};

} // namespace gsc
