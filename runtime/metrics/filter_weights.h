// SPDX-License-Identifier: Apache-2.0
// Weights of the filters of SSIM and FLIP, the same on a CPU and a GPU. A kernel's weights are symmetric about its
// middle.
#pragma once

#include <cstdint>
#include <vector>

namespace gsc {

// Returns the 11 weights of a Gaussian of sigma 1.5 (Wang et al. 2004), which add up to 1.
std::vector<double> ssimWindow();

// A term of the contrast sensitivity of one opponent channel, which is one Gaussian or the sum of two (table 1 of
// FLIP's paper). The filtered plane is the sum over the terms of `share` times the plane filtered along both axes with
// `kernel`.
struct SensitivityTerm {
    std::vector<double> kernel;
    float share;
};
// Returns the terms of a channel: 0 achromatic, 1 red-green, 2 blue-yellow.
std::vector<SensitivityTerm> sensitivityTerms(uint32_t channel, double pixels_per_degree);

// FLIP's detectors of edges and points: a Gaussian and its first two derivatives. The positive weights of a derivative
// add up to 1, the negative ones to -1.
struct FeatureFilters {
    std::vector<double> blur, first, second;
};
FeatureFilters featureFilters(double pixels_per_degree);

} // namespace gsc
