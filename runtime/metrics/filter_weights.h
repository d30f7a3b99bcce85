// SPDX-License-Identifier: Apache-2.0
// The weights of the filters of SSIM and FLIP, from the middle outwards alike on a CPU and a GPU.
#pragma once

#include <cstdint>
#include <vector>

namespace gsc {

// 11 weights of a Gaussian of sigma 1.5 (Wang et al. 2004); they add up to 1.
std::vector<double> ssimWindow();

// Contrast sensitivity of one opponent channel as one or two Gaussians (table 1 of FLIP's paper): the filtered plane is the
// sum over the terms of `share` times the plane filtered along both axes with `kernel`.
struct SensitivityTerm {
    std::vector<double> kernel;
    float share;
};
// `channel`: 0 achromatic, 1 red-green, 2 blue-yellow.
std::vector<SensitivityTerm> sensitivityTerms(uint32_t channel, double pixels_per_degree);

// FLIP's detectors of edges and points: a Gaussian and its derivatives. Positive weights of those add up to 1, negative ones
// to -1.
struct FeatureFilters {
    std::vector<double> blur, first, second;
};
FeatureFilters featureFilters(double pixels_per_degree);

} // namespace gsc
