// SPDX-License-Identifier: Apache-2.0
// Builds HTML pages that need no other file.
#pragma once

#include <nlohmann/json.hpp>

#include <span>
#include <string>
#include <string_view>
#include <utility>

namespace gsc {

// JSON text that may stand inside a <script> element: no string in it can end the element or open a comment.
std::string scriptJson(const nlohmann::ordered_json& json);

// Returns the template `page` with each mark replaced by its text. Marks must be given in the order in which the
// template has them; the inserted texts are not searched for marks.
std::string filledPage(std::string_view page, std::span<const std::pair<std::string_view, std::string_view>> parts);

} // namespace gsc
