// SPDX-License-Identifier: Apache-2.0
// Meanings of the colours of a FrameView.
#pragma once

#include <gsc/frame_types.h>

#include <string>
#include <vector>

namespace gsc {

struct LegendColour {
    float rgb[3]; // 0 to 1, as displayed
    std::string
        text; // level, frames or Gaussians evaluated: colours between two lie between them; how a group is drawn
};

// Empty for pictures. `levels`: of the model; from the thirteenth on colours repeat, and are not listed.
std::vector<LegendColour> colourLegend(FrameView view, uint32_t levels);

} // namespace gsc
