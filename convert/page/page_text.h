// SPDX-License-Identifier: Apache-2.0
// HTML pages that need nothing else.
#pragma once

#include <nlohmann/json.hpp>

#include <span>
#include <string>
#include <string_view>
#include <utility>

namespace gsc {

// JSON that may stand inside <script>: no text in it can end the element or open a comment.
std::string scriptJson(const nlohmann::ordered_json& json);

// The template with each mark replaced by its part. Marks come in the template's order; parts are not searched for
// marks.
std::string filledPage(std::string_view page, std::span<const std::pair<std::string_view, std::string_view>> parts);

} // namespace gsc
