// SPDX-License-Identifier: Apache-2.0
#include "convert/chart/chart_page.h"

#include "convert/chart/chart_assets.h"

#include <string_view>
#include <utility>

namespace gsc {

std::string scriptJson(const nlohmann::ordered_json& json)
{
    std::string text;
    for (const char c : json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace))
        if (c == '<') // occurs in strings only
            text += "\\u003c";
        else
            text += c;
    return text;
}

bool isServiceModel(const nlohmann::ordered_json& model)
{
    return model.contains("kind") && model["kind"] == "service";
}

std::string chartPage(const nlohmann::ordered_json& model)
{
    const std::string json = scriptJson(model);
    const bool service = isServiceModel(model);
    const std::pair<std::string_view, std::string_view> parts[] = {
        {"@STYLE@", pageStyle()},
        {"@MODEL@", json},
        {"@ECHARTS@", echartsScript()},
        {"@PARTS@", partsScript()},
        {"@FIGURES@", service ? serviceFiguresScript() : figuresScript()},
        {"@REPORT@", service ? serviceReportScript() : reportScript()}};
    std::string page;
    std::string_view rest = service ? servicePageTemplate() : pageTemplate();
    for (const auto& [mark, part] : parts) { // in the template's order; what is put in is not looked at again
        const size_t place = rest.find(mark);
        page.append(rest.substr(0, place)).append(part);
        rest.remove_prefix(place + mark.size());
    }
    return page.append(rest);
}

} // namespace gsc
