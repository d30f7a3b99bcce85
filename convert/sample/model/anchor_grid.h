// SPDX-License-Identifier: Apache-2.0
// The voxel grids a trainer leaves anchors on (format facts, 5.3), and the cells that are taken.
#pragma once

#include "convert/survey/vec3.h"

#include <cstdint>
#include <unordered_set>

namespace gsc {

constexpr uint32_t kMaxSampleLevels = 8;

struct AnchorGrid {
    uint32_t levels = 1;
    float quantum[kMaxSampleLevels] = {}; // fl32(voxel_size / 2^level)
    float origin = 0;                     // init_pos of Octree-GS, 0 for Scaffold-GS
    double voxel_decimal = 0;             // Scaffold-GS: voxel_size as cfg_args prints it
    int base_layer = 0;                   // Octree-GS
};

using GridCell = glm::ivec3;

// Largest of 1, 2, 5 x 10^n that is not above `spacing`, for cfg_args.
AnchorGrid scaffoldGrid(double spacing);
// Octree-GS's arithmetic: a box 1.1 times that of the points, halved base_layer times to at most `spacing` (that of
// level 0).
AnchorGrid octreeGrid(float low, float high, double spacing, uint32_t levels);

GridCell cellOf(const AnchorGrid& grid, uint32_t level, dvec3 position);
// Equal to the trainer's stored position, bit for bit.
void cellPosition(const AnchorGrid& grid, uint32_t level, const GridCell& cell, float out[3]);

// Cells taken on one tile. Tiles own half-open boxes in x and y, so no cell can be taken twice on two tiles.
class TakenCells {
public:
    TakenCells(const AnchorGrid& grid, bool bounded, const double min[2], const double max[2]);
    // The free cell nearest to `wanted`, which is then taken.
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

    GridCell m_first[kMaxSampleLevels], m_last[kMaxSampleLevels]; // the tile's
    std::unordered_set<Key, KeyHash> m_taken;
};

} // namespace gsc
