// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>

#include <string>

namespace gsc {

// JSON that may stand inside <script>: no text in it can end the element or open a comment.
std::string scriptJson(const nlohmann::ordered_json& json);
// Is it one of traceModel(), rather than of chartModel()? The two have figures and pages of their own.
bool isServiceModel(const nlohmann::ordered_json& model);
// One HTML file that needs nothing else, from a model as chartModel() or traceModel() makes it. Same model, same bytes.
std::string chartPage(const nlohmann::ordered_json& model);

} // namespace gsc
