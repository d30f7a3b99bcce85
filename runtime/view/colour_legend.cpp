// SPDX-License-Identifier: Apache-2.0
#include "runtime/view/colour_legend.h"

#include "kernels/present/false_colour.h"

#include <algorithm>
#include <utility>

namespace gsc {

std::vector<LegendColour> colourLegend(FrameView view, uint32_t levels)
{
    std::vector<LegendColour> legend;
    const auto add = [&](const FalseColour& colour, std::string text) {
        legend.push_back({{colour.r, colour.g, colour.b}, std::move(text)});
    };
    switch (view) {
    case FrameView::Picture:
        break;
    case FrameView::Level:
        for (uint32_t level = 0; level < std::min(levels, 12u); ++level)
            add(levelColour(int32_t(level)), std::to_string(level));
        break;
    case FrameView::Age:
        for (const uint32_t frames : {0, 3, 15, 63, 255})
            add(ageColour(frames), std::to_string(frames));
        break;
    case FrameView::Cost:
        for (const uint32_t evaluations : {0, 7, 63, 511, 4095})
            add(costColour(evaluations), std::to_string(evaluations));
        break;
    case FrameView::Detail:
        add(detailColour(GroupSource::Near), "near");
        add(detailColour(GroupSource::Kept), "kept");
        add(detailColour(GroupSource::Stale), "stale");
        add(detailColour(GroupSource::Made), "made");
        break;
    }
    return legend;
}

} // namespace gsc
