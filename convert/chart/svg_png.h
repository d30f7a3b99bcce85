// SPDX-License-Identifier: Apache-2.0
// SVG -> PNG with librsvg: the module gsc_figures_rsvg.
#pragma once

#include <cstddef>
#include <string>

namespace gsc {

// The bytes of the PNG; `name` is for messages. Throws Error(Internal).
std::string pngOfSvg(const std::string& svg, const std::string& name);

// Most threads that Pango starts at a time to find fonts. It ends the process if it cannot start one.
constexpr size_t kSvgPngThreads = 8;

struct SvgPngFunctions { // functions of the module
    decltype(&pngOfSvg) draw;
};

} // namespace gsc
