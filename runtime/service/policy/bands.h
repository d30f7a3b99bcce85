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
    // `count` bands of an image that is `width` pixels wide, from the left, the last of which may end beyond it. Fewer
    // where the image has not as many steps.
    std::vector<ColumnRange> cut(uint32_t width, uint32_t count);

    // How long each band took that cut() gave for this width. A band of 0 ms says nothing.
    void learn(uint32_t width, std::span<const ColumnRange> bands, std::span<const double> ms);

private:
    void fit(uint32_t width);

    std::vector<double> m_cost; // per step of columns, in any unit
};

} // namespace gsc
