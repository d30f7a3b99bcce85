// SPDX-License-Identifier: Apache-2.0
// Cells of a scene's surfaces -> rows of upstream's PLY.
#pragma once

#include "convert/sample/model/anchor_grid.h"
#include "convert/sample/model/sample_weights.h"
#include "convert/sample/scenes/lighting.h"

#include <cstdint>
#include <vector>

namespace gsc {

constexpr size_t kSampleRowFloats = 79; // F = 32, K = 10; Scaffold-GS and Octree-GS alike

// Writes the anchors of one tile. Not thread-safe; make one per task.
class SurfaceRows {
public:
    SurfaceRows(const SceneSpec& spec, const AnchorGrid& grid, SampleModel model, const SceneTile& tile);

    // Cells [first, last) of `layout` on `surface`, which lies at `level`.
    void add(const Surface& surface, uint32_t level, const CellLayout& layout, uint64_t first, uint64_t last);

    std::vector<float>& rows() { return m_rows; } // kSampleRowFloats each

private:
    struct Patch; // one cell, evaluated

    void evaluate(const Surface& surface, const Cell& cell, const NearOccluders& near, uint64_t key, Patch& patch);
    void writeRow(const Surface& surface, const Cell& cell, uint32_t level, const Patch& patch, const GridCell& at,
                  uint64_t key);

    const SceneSpec& m_spec;
    const AnchorGrid& m_grid;
    bool m_octree;
    SceneLight m_light;
    TakenCells m_taken;
    double m_inset = 0; // inset of the current surface, metres; 0 at its finest level
    double m_body = 0;  // half its smallest size
    NearOccluders m_near_surface, m_near_cell;
    std::vector<float> m_rows;
};

} // namespace gsc
