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

// Reorders `which`: Gaussians of the lower half of space first. Halves are separated across the longest side of the box
// round their centres; the lower half gets `first` Gaussians.
void splitInSpace(const GaussianSet& set, std::span<uint32_t> which, size_t first);

} // namespace gsc
