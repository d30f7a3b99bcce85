// SPDX-License-Identifier: Apache-2.0
// Replaces many Gaussians by few that look alike from afar.
#pragma once

#include "convert/export/gaussian_set.h"

#include <cstdint>
#include <span>
#include <vector>

namespace gsc {

constexpr size_t kStandsFor = 4; // most Gaussians that one of the next level replaces

// Groups the Gaussians `which` by fours of neighbours and appends to `set` one Gaussian for each group. Returns the
// numbers of the new ones. Changes the order of `which`.
std::vector<uint32_t> appendStandIns(GaussianSet& set, std::span<uint32_t> which);

// Orders `which` so that the `first` Gaussians at the lower end of the longest side of their box come first.
void splitInSpace(const GaussianSet& set, std::span<uint32_t> which, size_t first);

} // namespace gsc
