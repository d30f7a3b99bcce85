// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>

#include <string>
#include <string_view>

namespace gsc {

// What a model is of: of chartModel(), traceModel() or curveModel(), which have figures and pages of their own.
enum class PageKind { Runs, Service, Curve };
PageKind kindOf(const nlohmann::ordered_json& model);
// The script that draws its figures.
std::string_view figuresScriptOf(PageKind kind);
// One HTML file that needs nothing else, from a model as one of those makes it. Same model, same bytes.
std::string chartPage(const nlohmann::ordered_json& model);

} // namespace gsc
