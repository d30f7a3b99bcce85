// SPDX-License-Identifier: Apache-2.0
// SVG -> PNG with librsvg: the module gsc_figures_rsvg.
#pragma once

#include <cstddef>
#include <string>

namespace gsc {

// The bytes of the PNG; `name` is for messages. Throws Error(Internal).
std::string pngOfSvg(const std::string& svg, const std::string& name);

// That Pango starts at a time to find fonts, some of them ending as others begin; without one it ends the process.
constexpr size_t kSvgPngThreads = 8;

struct SvgPngFunctions { // of the module
    decltype(&pngOfSvg) draw;
};

} // namespace gsc
