// SPDX-License-Identifier: Apache-2.0
// Levels of detail of explicit Gaussians as viewers stream them: each level stands for everything, level 0 is the finest, and
// a viewer chooses a level for each part of space.
//
// The coarser levels of a model with levels are its own: its anchors from the coarsest level to some level, as the trainer
// drew it from afar. One that leaves out less than a quarter of the Gaussians is no level here. Below the coarsest, and in
// models without levels, each level has a quarter of the Gaussians of the finer one (stand_in.h), until there are few.
#pragma once

#include "convert/export/gaussian_set.h"

#include <cstdint>
#include <vector>

namespace gsc {

constexpr size_t kLodLeafGaussians = 1u << 15; // most Gaussians of the finest level in a leaf
constexpr size_t kLodFewGaussians = 1u << 14;  // a model of so few needs no coarser level: a quarter of a megabyte
constexpr size_t kMostLods = 8;

struct LodNode {
    float least[3], most[3];        // box of its Gaussians of all levels, each a standard deviation round its centre
    std::vector<uint32_t> children; // two, or none of a leaf
    // for each level, the indices of the leaf's Gaussians; empty in an inner node
    std::vector<std::vector<uint32_t>> levels;
};

struct LodModel {
    std::vector<LodNode> nodes; // [0] is the root, parents before children
    std::vector<size_t> counts; // Gaussians of each level
};

// Appends the stand-ins to `set`. Precondition: there is a Gaussian.
LodModel makeLodModel(GaussianSet& set);

} // namespace gsc
