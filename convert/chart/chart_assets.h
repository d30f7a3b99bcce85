// SPDX-License-Identifier: Apache-2.0
// Text of the files of page/ and of ECharts, which are built into the program.
#pragma once

#include <string_view>

namespace gsc {

std::string_view pageTemplate(); // page/page.html, with marks that chart_page.cpp replaces
std::string_view pageStyle();
std::string_view partsScript();
std::string_view figuresScript();
std::string_view reportScript();
std::string_view plainPageTemplate(); // page/plain_page.html, for a model of trace_model.h or curve_model.h
std::string_view serviceFiguresScript();
std::string_view curveFiguresScript();
std::string_view plainReportScript();
std::string_view stillScript();
std::string_view echartsScript();

} // namespace gsc
