// SPDX-License-Identifier: Apache-2.0
#include "player/window/false_colour_legend.h"

#include "kernels/present/false_colour.h"

#include <algorithm>

namespace gsc {

OverlayLegend legendOf(FrameView view, uint32_t levels)
{
    OverlayLegend legend;
    const auto add = [&](const FalseColour& colour, uint32_t value) {
        legend.colours.push_back({{colour.r, colour.g, colour.b}, std::to_string(value)});
    };
    switch (view) {
    case FrameView::Picture:
        break;
    case FrameView::Level:
        legend.title = "level";
        for (uint32_t level = 0; level < std::min(levels, 12u); ++level) // then the colours repeat
            add(levelColour(int32_t(level)), level);
        break;
    case FrameView::Age:
        legend.title = "frames since decoded";
        for (const uint32_t frames : {0, 3, 15, 63, 255})
            add(ageColour(frames), frames);
        break;
    case FrameView::Cost:
        legend.title = "Gaussians evaluated";
        for (const uint32_t evaluations : {0, 7, 63, 511, 4095})
            add(costColour(evaluations), evaluations);
        break;
    }
    return legend;
}

} // namespace gsc
