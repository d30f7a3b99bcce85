// SPDX-License-Identifier: Apache-2.0
// FLIP once more, written for reading and not for speed: full two-dimensional kernels, one pixel at a time, every
// step straight from the paper. Tests compare the separable version with it.
#pragma once

#include "runtime/metrics/metrics.h"

#include <vector>

namespace gsc::test {

// Per-pixel error.
std::vector<double> naiveFlip(const ImageView& reference, const ImageView& test, double pixels_per_degree);

} // namespace gsc::test
