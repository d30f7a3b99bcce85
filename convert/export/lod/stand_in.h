// SPDX-License-Identifier: Apache-2.0
// Few Gaussians that stand for many, seen from afar.
#pragma once

#include "convert/export/gaussian_set.h"

#include <cstdint>
#include <span>
#include <vector>

namespace gsc {

constexpr size_t kStandsFor = 4; // Gaussians, at most, one of the next level

// Appends to `set` one Gaussian for each four neighbours of `which`, whose order changes, and returns their numbers.
std::vector<uint32_t> appendStandIns(GaussianSet& set, std::span<uint32_t> which);

// Puts those of `which` in the lower half of space before the others; their number is returned. Halves are taken across
// the longest side of the box round their centres, and the lower one has `first` of them.
void splitInSpace(const GaussianSet& set, std::span<uint32_t> which, size_t first);

} // namespace gsc
