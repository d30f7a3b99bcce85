// SPDX-License-Identifier: Apache-2.0
// Meanings of the colours of a FrameView, for a legend.
#pragma once

#include <gsc/frame_types.h>

#include <string>
#include <vector>

namespace gsc {

struct LegendColour {
    float rgb[3];     // red, green and blue, 0 to 1, as displayed
    std::string text; // meaning of the colour: a level, a number or a source of a group
};

// Returns the colours of a view; empty for FrameView::Picture. `levels` is the number of levels of the model; colours
// repeat from the thirteenth level on, which are left out.
std::vector<LegendColour> colourLegend(FrameView view, uint32_t levels);

} // namespace gsc
