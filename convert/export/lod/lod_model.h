// SPDX-License-Identifier: Apache-2.0
// Levels of detail of explicit Gaussians, as viewers stream them: each level shows the whole model, level 0 is the
// finest, and a viewer chooses a level for each part of space.
//
// A model with levels gives its own ones: all anchors from its coarsest level up to some level, as the trainer drew
// them from afar. A level of the model that has more than three quarters of the Gaussians of the finer one is not
// exported. After the model's coarsest level, and in models without levels, each further level has a quarter of the
// Gaussians of the one before (stand_in.h), until there are few.
#pragma once

#include "convert/export/gaussian_set.h"

#include <cstdint>
#include <vector>

namespace gsc {

constexpr size_t kLodLeafGaussians = 1u << 15; // most Gaussians of level 0 in a leaf of the tree
// a level with so few Gaussians (a quarter of a megabyte) needs no coarser one
constexpr size_t kLodFewGaussians = 1u << 14;
constexpr size_t kMostLods = 8;

struct LodNode {
    // box round its Gaussians of all levels: one standard deviation to each side of their centres
    float least[3], most[3];
    std::vector<uint32_t> children; // numbers of two nodes; empty for a leaf
    // For each level, the numbers of the leaf's Gaussians; empty for an inner node.
    std::vector<std::vector<uint32_t>> levels;
};

struct LodModel {
    std::vector<LodNode> nodes; // nodes[0] is the root; parents come before children
    std::vector<size_t> counts; // number of Gaussians of each level
};

// Builds the tree, and appends the Gaussians of the coarse levels to `set`. Precondition: `set` is not empty.
LodModel makeLodModel(GaussianSet& set);

} // namespace gsc
