// SPDX-License-Identifier: Apache-2.0
// SVG -> PNG with librsvg: the module gsc_figures_rsvg.
#pragma once

#include <string>

namespace gsc {

// The bytes of the PNG; `name` is for messages. Throws Error(Internal).
std::string pngOfSvg(const std::string& svg, const std::string& name);

struct SvgPngFunctions { // of the module
    decltype(&pngOfSvg) draw;
};

} // namespace gsc
