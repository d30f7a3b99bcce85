// SPDX-License-Identifier: Apache-2.0
// Shares out the anchors of a sample: each level of each surface gets a range of [0, anchors), in order.
#pragma once

#include "convert/sample/model/anchor_grid.h"
#include "convert/sample/sample.h"
#include "convert/sample/scenes/scene.h"

#include <cstdint>
#include <vector>

namespace gsc {

struct SamplePlan {
    SceneSpec spec;
    uint64_t anchors = 0;
    uint32_t levels = 1;
    // share of each level among the anchors of a surface that has all levels; the sum is 1
    double level_share[kMaxSampleLevels] = {};
    double weight_of[size_t(AnchorShare::Count)] = {}; // anchors per square metre and unit of Surface::density
    // number of the first anchor of each tile, and of the end; tile_count + 1 values, not rounded
    std::vector<double> tile_start;
    AnchorGrid grid;
    float standard_dist = 0; // Octree-GS's standard_dist in world units
};

SamplePlan planSample(const SampleOptions& options);

// Anchors [first, last) of the model are those of one level of one surface of a tile.
struct SurfaceShare {
    uint32_t surface, level;
    uint64_t first, last;
};

uint64_t tileFirst(const SamplePlan& plan, uint32_t tile);
// Ranges of a tile in the order of the anchors, without gaps.
std::vector<SurfaceShare> shareTile(const SamplePlan& plan, uint32_t tile, const SceneTile& content);

} // namespace gsc
