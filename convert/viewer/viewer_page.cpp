// SPDX-License-Identifier: Apache-2.0
#include "convert/viewer/viewer_page.h"

#include "convert/page/page_text.h"
#include "convert/viewer/viewer_assets.h"

#include <algorithm>
#include <cstdint>
#include <string_view>
#include <utility>

namespace gsc {

namespace {

std::string base64(std::span<const std::byte> bytes)
{
    constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    text.reserve((bytes.size() + 2) / 3 * 4);
    for (size_t i = 0; i < bytes.size(); i += 3) {
        const size_t count = std::min<size_t>(bytes.size() - i, 3);
        uint32_t three = 0;
        for (size_t k = 0; k < 3; ++k)
            three = three << 8 | (k < count ? uint32_t(bytes[i + k]) : 0u);
        for (size_t k = 0; k < 4; ++k)
            text += k <= count ? kDigits[three >> (18 - 6 * k) & 63u] : '=';
    }
    return text;
}

std::string escaped(const std::string& text)
{
    std::string safe;
    for (const char c : text)
        safe += c == '<' ? "&lt;" : c == '&' ? "&amp;" : std::string(1, c);
    return safe;
}

} // namespace

std::string viewerPage(const nlohmann::ordered_json& model, std::span<const std::byte> sog)
{
    const std::string title = escaped(model.at("name").get<std::string>()), json = scriptJson(model),
                      data = base64(sog);
    const std::pair<std::string_view, std::string_view> parts[] = {
        {"@TITLE@", title}, {"@STYLE@", viewerStyle()},       {"@LICENCE@", playcanvasLicence()}, {"@MODEL@", json},
        {"@SOG@", data},    {"@ENGINE@", playcanvasScript()}, {"@SCRIPT@", viewerScript()}};
    return filledPage(viewerTemplate(), parts);
}

} // namespace gsc
