// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace gsc {

// A run in a plane: faster and more accurate is better.
struct SpeedAccuracy {
    double ms = 0;
    double psnr = 0; // dB, +infinity allowed
};

// Points that no other point beats, by being better in one of the two and no worse in the other. Indices into `points`,
// fastest first; of points that are equal in both, all. Values must not be NaN.
std::vector<size_t> paretoFront(std::span<const SpeedAccuracy> points);

// `count` of the indices, evenly spaced, with the first and the last; all if there are no more.
std::vector<size_t> thinned(const std::vector<size_t>& indices, size_t count);

} // namespace gsc
