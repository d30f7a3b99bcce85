// SPDX-License-Identifier: Apache-2.0
// Cuts an image into bands that take equally long, one for each worker. No input but its arguments.
#pragma once

#include <gsc/frame_types.h>

#include <span>
#include <vector>

namespace gsc {

// Costs of the image's columns, learned from frame to frame, by which it is cut into bands of equal cost.
class BandBalance {
public:
    // Cuts an image `width` pixels wide into `count` bands, from left to right; the last may end beyond the image.
    // Returns fewer if there are fewer steps of columns (kColumnStep).
    std::vector<ColumnRange> cut(uint32_t width, uint32_t count);

    // Learns from the time of each band that cut() returned for this width. A band with 0 ms is ignored.
    void learn(uint32_t width, std::span<const ColumnRange> bands, std::span<const double> ms);

private:
    void fit(uint32_t width);

    std::vector<double> m_cost; // cost of each step of columns, in any unit
};

} // namespace gsc
