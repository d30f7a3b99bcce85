// SPDX-License-Identifier: Apache-2.0
// Turns cells of a scene's surfaces into rows of the trainers' PLY.
#pragma once

#include "convert/sample/model/anchor_grid.h"
#include "convert/sample/model/sample_weights.h"
#include "convert/sample/scenes/lighting.h"

#include <cstdint>
#include <vector>

namespace gsc {

// floats in a row, with F = 32 and K = 10; equal for Scaffold-GS and Octree-GS
constexpr size_t kSampleRowFloats = 79;

// Makes the rows of one tile. Not thread-safe: use one object per thread.
class SurfaceRows {
public:
    SurfaceRows(const SceneSpec& spec, const AnchorGrid& grid, SampleModel model, const SceneTile& tile);

    // Adds the anchors of the cells [first, last) of `layout` on `surface`, on level `level`.
    void add(const Surface& surface, uint32_t level, const CellLayout& layout, uint64_t first, uint64_t last);

    std::vector<float>& rows() { return m_rows; } // kSampleRowFloats values per anchor

private:
    struct Patch; // the Gaussians of one cell

    void evaluate(const Surface& surface, const Cell& cell, const NearOccluders& near, uint64_t key, Patch& patch);
    void writeRow(const Surface& surface, const Cell& cell, uint32_t level, const Patch& patch, const GridCell& at,
                  uint64_t key);

    const SceneSpec& m_spec;
    const AnchorGrid& m_grid;
    bool m_octree;
    SceneLight m_light;
    TakenCells m_taken;
    double m_inset = 0; // metres by which the current surface is sunk into its body; 0 on the finest level
    double m_body = 0;  // metres, half of the smallest size of the current body
    NearOccluders m_near_surface, m_near_cell;
    std::vector<float> m_rows;
};

} // namespace gsc
