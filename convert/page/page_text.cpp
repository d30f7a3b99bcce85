// SPDX-License-Identifier: Apache-2.0
#include "convert/page/page_text.h"

namespace gsc {

std::string scriptJson(const nlohmann::ordered_json& json)
{
    std::string text;
    for (const char c : json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace))
        if (c == '<') // in JSON this character stands only in strings, where it may be escaped
            text += "\\u003c";
        else
            text += c;
    return text;
}

std::string filledPage(std::string_view page, std::span<const std::pair<std::string_view, std::string_view>> parts)
{
    std::string filled;
    for (const auto& [mark, part] : parts) {
        const size_t place = page.find(mark);
        filled.append(page.substr(0, place)).append(part);
        page.remove_prefix(place + mark.size());
    }
    return filled.append(page);
}

} // namespace gsc
