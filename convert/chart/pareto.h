// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace gsc {

struct SpeedAccuracy {
    double ms = 0;
    double psnr = 0; // dB, +infinity allowed
};

// The points that no other one beats: none is at least as fast and as accurate and better in one of the two. Indices
// into `points`, fastest first; points equal in both are all members. Values must not be NaN.
std::vector<size_t> paretoFront(std::span<const SpeedAccuracy> points);

// `count` of them, evenly spaced, first and last among them; all where there are no more.
std::vector<size_t> thinned(const std::vector<size_t>& indices, size_t count);

} // namespace gsc
