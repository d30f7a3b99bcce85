// SPDX-License-Identifier: Apache-2.0
// Explicit Gaussians as viewers of 3DGS take them: fixed values instead of an anchor and networks.
#pragma once

#include "convert/export/sh_basis.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gsc {

// n Gaussians, one array for each kind of value. World units, with the axes of COLMAP (x right, y down, z forward as
// seen from the first camera).
struct GaussianSet {
    int degree = 0;               // degree of the colours' spherical harmonics, 0 to 3
    std::vector<float> position;  // n x 3 values
    std::vector<float> log_scale; // n x 3 values: natural logarithms of the standard deviations
    std::vector<float> rotation;  // n x 4 values: unit quaternions w x y z
    std::vector<float> opacity;   // n values, 0 to 1
    // n x shValues(degree) x 3 values; 0.5 is added to the sum of the harmonics, as in 3DGS
    std::vector<float> color;
    // n values: how many pixels of the cameras' pictures the Gaussian may cover, weighted by opacity; 0 = not measured
    std::vector<float> score;
    // n values: index in the file of the level of the anchor, 0 = coarsest; empty if read back from an export
    std::vector<uint16_t> level;
    // n values: share of the views of its anchor that draw the anchor's level, 0 to 1; empty if read back
    std::vector<float> shown;

    [[nodiscard]] size_t size() const { return opacity.size(); }
    // number of colour values of one Gaussian
    [[nodiscard]] size_t colorValues() const { return 3 * shValues(degree); }
};

// Copies the Gaussians with these numbers, in this order; scores and levels are not copied.
GaussianSet pick(const GaussianSet& set, std::span<const uint32_t> which);

// Appends the Gaussians of `part`, whose degree must be equal. `set` stays as it is if memory is too short (bad_alloc).
void append(GaussianSet& set, const GaussianSet& part);

// Keeps the `most` Gaussians with the highest scores, in their order; of equal scores the earlier ones.
void keepBest(GaussianSet& set, size_t most);

// Keeps the Gaussians with these numbers, which must rise.
void keepOnly(GaussianSet& set, std::span<const uint32_t> which);

} // namespace gsc
