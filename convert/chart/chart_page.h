// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>

#include <string>
#include <string_view>

namespace gsc {

// Kind of a model, made by chartModel(), traceModel() or curveModel(). Each kind has figures and a page of its own.
enum class PageKind { Runs, Service, Curve };
PageKind kindOf(const nlohmann::ordered_json& model);
// Script that draws the figures of a kind.
std::string_view figuresScriptOf(PageKind kind);
// One HTML file that needs no other file and no network. Equal models give equal bytes.
std::string chartPage(const nlohmann::ordered_json& model);

} // namespace gsc
