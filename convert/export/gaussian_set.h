// SPDX-License-Identifier: Apache-2.0
// Explicit Gaussians as viewers of 3DGS take them: fixed values in place of an anchor's networks.
#pragma once

#include "convert/export/sh_basis.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gsc {

// Structure of arrays, n Gaussians. World units, COLMAP axes (x right, y down, z forward of the cameras' first).
struct GaussianSet {
    int degree = 0;               // degree of the colours' spherical harmonics, 0 to 3
    std::vector<float> position;  // n x 3
    std::vector<float> log_scale; // n x 3, natural logarithms of standard deviations
    std::vector<float> rotation;  // n x 4, unit quaternions w x y z
    std::vector<float> opacity;   // n, 0 to 1
    std::vector<float> color;     // n x shValues(degree) x 3; what they add up to is counted from 0.5, as in 3DGS
    std::vector<float> score;     // n, pixels of the cameras' pictures that each may cover; 0 if not asked for
    std::vector<uint16_t>
        level; // n, of its anchor, an index of the file's levels, 0 = coarsest; empty for one read back

    [[nodiscard]] size_t size() const { return opacity.size(); }
    [[nodiscard]] size_t colorValues() const { return 3 * shValues(degree); } // floats of colour per Gaussian
};

// Some of a set, in the order of `which`; their scores and levels stay behind.
GaussianSet pick(const GaussianSet& set, std::span<const uint32_t> which);

// Appends `part`, of the same degree.
void append(GaussianSet& set, const GaussianSet& part);

// Leaves the `most` of the highest score, in their order. Ties: the earlier stay.
void keepBest(GaussianSet& set, size_t most);

} // namespace gsc
