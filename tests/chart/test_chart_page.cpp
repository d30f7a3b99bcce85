// SPDX-License-Identifier: Apache-2.0
// The page and the figures as files.
#include "convert/chart/chart_assets.h"
#include "convert/chart/chart_model.h"
#include "convert/chart/chart_page.h"
#include "tests/chart/run_lines.h"

#include <doctest/doctest.h>

using namespace gsc;
using nlohmann::json;

namespace {

size_t occurrences(const std::string& text, std::string_view what)
{
    size_t count = 0;
    for (size_t at = text.find(what); at != text.npos; at = text.find(what, at + 1))
        ++count;
    return count;
}

std::string between(const std::string& text, std::string_view from, std::string_view to)
{
    const size_t begin = text.find(from) + from.size();
    return text.substr(begin, text.find(to, begin) - begin);
}

} // namespace

TEST_CASE("what is embedded cannot end its element")
{
    for (const std::string_view script : {echartsScript(), partsScript(), figuresScript(), reportScript(),
                                          serviceFiguresScript(), curveFiguresScript(), plainReportScript()}) {
        CHECK(script.size() > 1000);
        CHECK(script.find("</script") == script.npos);
        CHECK(script.find("<!--") == script.npos);
    }
    CHECK(pageStyle().find("</style") == std::string_view::npos);
}

TEST_CASE("the page holds the model unharmed, and no name in it becomes markup")
{
    const auto model = chartModel(hostileRuns());
    const std::string page = chartPage(model);
    CHECK(occurrences(page, "<script") == occurrences(chartPage(chartModel({parsed(plainRun())})), "<script"));
    CHECK(page.find("alert(1)</script>") == page.npos);
    const std::string text = between(page, "id=\"model\">", "</script>");
    CHECK(text.find('<') == text.npos);
    CHECK(nlohmann::ordered_json::parse(text) == model);
    for (const char* mark : {"@STYLE@", "@ECHARTS@", "@PARTS@", "@FIGURES@", "@REPORT@"})
        CHECK(page.find(mark) == page.npos);
}

TEST_CASE("the page asks for nothing from elsewhere")
{
    const std::string page = chartPage(chartModel({parsed(plainRun())}));
    CHECK(page.find("default-src 'none'") != page.npos);
    for (const char* fetch : {" src=\"http", " href=\"http", "url(http", "@import", "fetch(", "XMLHttpRequest"})
        CHECK_MESSAGE(page.find(fetch) == page.npos, fetch);
}

TEST_CASE("same runs, same bytes")
{
    CHECK(chartPage(chartModel(hostileRuns())).size() > 600000);
    const auto lines = {runOf("none", 6.123456789, 61.987654321), runOf("error", 1.0 / 3, 2.0 / 3)};
    std::vector<ChartRun> rows;
    for (const json& line : lines)
        rows.push_back(parsed(line));
    CHECK(chartPage(chartModel(rows)) == chartPage(chartModel(rows)));
}
