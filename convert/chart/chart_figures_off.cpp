// SPDX-License-Identifier: Apache-2.0
// Stands in for chart_figures.cpp in builds without Duktape or librsvg.
#include "convert/chart/chart_figures.h"

#include <gsc/error.h>

namespace gsc {

bool hasFigures()
{
    return false;
}

void requireFigures()
{
    throw Error(ErrorCode::Unsupported, "--figures", "this gsc was built without figures", "Duktape and librsvg",
                "run .ci/setup.sh figures and build it again, or leave --figures out: the page has the same figures");
}

std::vector<FigureFile> drawFigures(const nlohmann::ordered_json& /*model*/,
                                    const std::function<void(size_t done, size_t total)>& /*progress*/)
{
    requireFigures();
    return {};
}

} // namespace gsc
