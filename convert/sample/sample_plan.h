// SPDX-License-Identifier: Apache-2.0
// How the anchors of a sample are shared out: every level of every surface gets its part of [0, anchors), in order.
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
    double level_share[kMaxSampleLevels] = {}; // share of each level in the anchors of a surface with all levels
    double weight_of[size_t(AnchorShare::Count)] = {}; // anchors per weighted area
    std::vector<double> tile_start;                    // tile_count + 1, in anchors
    AnchorGrid grid;
    float standard_dist = 0; // Octree-GS
};

SamplePlan planSample(const SampleOptions& options);

// Anchors [first, last) of the model lie on this level of this surface.
struct SurfaceShare {
    uint32_t surface, level;
    uint64_t first, last;
};

uint64_t tileFirst(const SamplePlan& plan, uint32_t tile);
// In the order of the anchors; the shares of a tile join without a gap.
std::vector<SurfaceShare> shareTile(const SamplePlan& plan, uint32_t tile, const SceneTile& content);

} // namespace gsc
