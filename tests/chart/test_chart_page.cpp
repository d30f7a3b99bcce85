// SPDX-License-Identifier: Apache-2.0
// The page and the figures as files.
#include "convert/chart/chart_assets.h"
#include "convert/chart/chart_figures.h"
#include "convert/chart/chart_model.h"
#include "convert/chart/chart_page.h"
#include "format/error.h"
#include "tests/chart/run_lines.h"

#include <doctest/doctest.h>

using namespace gsc;
using nlohmann::json;

namespace {

const char* const kHostile = "</script><script>alert(1)</script><!-- & \"quoted\" 'x' {a|b} @MODEL@ \xe2\x80\xa8";

std::vector<RunRow> hostileRuns()
{
    json one = runOf("none", 6, nullptr), two = runOf("error", 2, 40);
    for (json* line : {&one, &two}) {
        (*line)["config"]["trajectory"] = kHostile;
        (*line)["file"]["path"] = kHostile;
        (*line)["label"] = kHostile;
    }
    two["config"]["policy"] = kHostile;
    return {parsed(one), parsed(two)};
}

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
    for (const std::string_view script : {echartsScript(), figuresScript(), reportScript()}) {
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
    for (const char* mark : {"@STYLE@", "@ECHARTS@", "@FIGURES@", "@REPORT@"})
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
    std::vector<RunRow> rows;
    for (const json& line : lines)
        rows.push_back(parsed(line));
    CHECK(chartPage(chartModel(rows)) == chartPage(chartModel(rows)));
}

TEST_CASE("figures: SVG and PNG of every kind and panel, or a refusal that names what is missing")
{
    json turn = plainRun();
    turn["config"]["trajectory"] = "turn";
    std::vector<RunRow> rows = hostileRuns();
    rows.push_back(parsed(turn));
    const auto model = chartModel(rows);
    const auto ignore = [](size_t, size_t) {};
    if (!figuresMissing().empty()) {
        try {
            drawFigures(model, ignore);
            FAIL("drawn without what it needs");
        } catch (const Error& error) {
            CHECK(error.code() == ErrorCode::Unsupported);
            CHECK(std::string(error.what()).find(figuresMissing()) != std::string::npos);
        }
        return;
    }
    size_t calls = 0;
    const std::vector<FigureFile> files = drawFigures(model, [&](size_t done, size_t total) {
        CHECK(done == ++calls);
        CHECK(total == 6);
    });
    REQUIRE(files.size() == 12);
    CHECK(calls == 6);
    for (const FigureFile& file : files) {
        CAPTURE(file.name);
        if (file.name.ends_with(".png")) {
            CHECK(file.bytes.starts_with("\x89PNG"));
            CHECK(file.bytes.size() > 4000);
        } else {
            CHECK(file.name.ends_with(".svg"));
            CHECK(file.bytes.starts_with("<svg "));
            CHECK(file.bytes.find("<script") == file.bytes.npos);
            CHECK(file.bytes.find("dominant-baseline") == file.bytes.npos);
            CHECK(file.bytes.find("NaN") == file.bytes.npos);
        }
    }
    CHECK(files[11].name == "turn-over-time.svg");
    CHECK(files[7].bytes.find(">equal<") != std::string::npos); // where equal images are drawn
    const std::vector<FigureFile> again = drawFigures(model, ignore);
    for (size_t i = 0; i < files.size(); ++i)
        CHECK(files[i].bytes == again[i].bytes);
}

TEST_CASE("figures of odd runs: one frame, all broken, all equal, frames of other numbers, no memory, no time")
{
    if (!figuresMissing().empty())
        return;
    json single = plainRun(), broken = runOf("error", 0, kBrokenPsnr), longer = runOf("depth", 1e6, 1e-3);
    single["per_frame"] = {{"wall_ms", {4}}, {"psnr", {nullptr}}, {"temporal", {nullptr}}, {"decoded", {0}}};
    broken["per_frame"]["psnr"] = {kBrokenPsnr, kBrokenPsnr};
    broken["accuracy"]["max_error"] = 1e30;
    broken["peak_bytes"] = 0;
    longer["per_frame"] = {{"wall_ms", {4, 4, 4}},
                           {"psnr", {nullptr, kBrokenPsnr, 3}},
                           {"temporal", {nullptr, 1, 0}},
                           {"decoded", {0, 1e9, 3}}};
    const auto drawn = drawFigures(chartModel({parsed(broken), parsed(plainRun())}), [](size_t, size_t) {});
    CHECK(drawn[1].bytes.find(">broken<") != std::string::npos);
    CHECK(drawn[1].bytes.find(">equal<") != std::string::npos);
    const std::vector<std::vector<RunRow>> cases = {
        {parsed(single)}, {parsed(broken)}, {parsed(plainRun())}, {parsed(single), parsed(broken), parsed(longer)}};
    for (const std::vector<RunRow>& rows : cases)
        for (const FigureFile& file : drawFigures(chartModel(rows), [](size_t, size_t) {})) {
            if (!file.name.ends_with(".svg"))
                continue; // any bytes
            CAPTURE(file.name);
            CHECK(file.bytes.find("NaN") == file.bytes.npos);
            CHECK(file.bytes.find("Infinity") == file.bytes.npos);
            CHECK(file.bytes.find("undefined") == file.bytes.npos);
        }
}
