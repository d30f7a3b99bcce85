// SPDX-License-Identifier: Apache-2.0
// Bands of an image that take equally long, one for each worker. Pure.
#pragma once

#include <gsc/frame_types.h>

#include <span>
#include <vector>

namespace gsc {

// Costs of the image's columns, learned from frame to frame, to cut it into bands of equal cost.
class BandBalance {
public:
    // Cuts an image `width` pixels wide into `count` bands, from the left; the last may end beyond the image. Returns
    // fewer if the image has not enough steps of columns.
    std::vector<ColumnRange> cut(uint32_t width, uint32_t count);

    // Learns the time of each band that cut() gave for this width. A band of 0 ms is ignored.
    void learn(uint32_t width, std::span<const ColumnRange> bands, std::span<const double> ms);

private:
    void fit(uint32_t width);

    std::vector<double> m_cost; // per step of columns, in any unit
};

} // namespace gsc
