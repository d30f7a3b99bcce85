// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>

#include <string>
#include <string_view>

namespace gsc {

// Kind of a model: made by chartModel(), traceModel() or curveModel(). Each kind has figures and a page of its own.
enum class PageKind { Runs, Service, Curve };
PageKind kindOf(const nlohmann::ordered_json& model);
// The script that draws its figures.
std::string_view figuresScriptOf(PageKind kind);
// One HTML file that needs nothing else, from a model that one of these functions made. Same model, same bytes.
std::string chartPage(const nlohmann::ordered_json& model);

} // namespace gsc
