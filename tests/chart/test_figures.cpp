// SPDX-License-Identifier: Apache-2.0
// The figures as files. The page draws the same with the same scripts.
#include "convert/chart/chart_figures.h"
#include "convert/chart/chart_model.h"
#include <gsc/error.h>
#include "tests/chart/run_lines.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <regex>

using namespace gsc;
using nlohmann::json;

namespace {

// The SVG of a kind of the first panel.
std::string svgOf(const std::vector<ChartRun>& rows, const std::string& kind)
{
    for (const FigureFile& file : drawFigures(chartModel(rows), [](size_t, size_t) {}))
        if (file.name.ends_with(kind + ".svg"))
            return file.bytes;
    FAIL("no figure " << kind);
    return {};
}

struct Text {
    double x = 0, y = 0, width = 0;
    std::string words;
};

// Texts of a figure, each from its left end, as wide as a wide font (DejaVu Sans, where a browser finds no other) makes
// it.
std::vector<Text> textsOf(const std::string& svg)
{
    std::vector<Text> texts;
    const std::regex text("<text([^>]*)>([^<]*)</text>"), size("font-size:([0-9]+)px"),
        move("translate\\(([-0-9.]+) ([-0-9.]+)\\)"), across(" x=\"([-0-9.]+)\""), down(" y=\"([-0-9.]+)\"");
    const auto number = [](const std::string& where, const std::regex& what, size_t group) {
        std::smatch found;
        return std::regex_search(where, found, what) ? std::stod(found[group]) : 0;
    };
    for (std::sregex_iterator at(svg.begin(), svg.end(), text), end; at != end; ++at) {
        const std::string attributes = (*at)[1], words = (*at)[2];
        if (attributes.find("text-anchor=\"start\"") == attributes.npos || attributes.find("rotate") != attributes.npos)
            continue;
        constexpr double kNarrow = 0.34, kOther = 0.6; // widths in units of the size
        double width = 0;
        for (const char letter : words)
            width += std::string(" .,;:ijl'!|()[]ftr-/").find(letter) == std::string::npos ? kOther : kNarrow;
        texts.push_back({number(attributes, across, 1) + number(attributes, move, 1),
                         number(attributes, down, 1) + number(attributes, move, 2), width * number(attributes, size, 1),
                         words});
    }
    return texts;
}

} // namespace

TEST_CASE("figures: SVG and PNG of every kind and panel, or a refusal that names what is missing")
{
    json turn = plainRun();
    turn["config"]["trajectory"] = "turn";
    std::vector<ChartRun> rows = hostileRuns();
    rows.push_back(parsed(turn));
    const auto model = chartModel(rows);
    const auto ignore = [](size_t, size_t) {};
    if (!hasFigures()) {
        try {
            drawFigures(model, ignore);
            FAIL("drawn without what it needs");
        } catch (const Error& error) {
            CHECK(error.code() == ErrorCode::Unsupported);
            CHECK(std::string(error.what()).find("figures") != std::string::npos);
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

TEST_CASE("figures of odd runs: one frame, all broken, all equal, frames of other numbers, no memory, hardly any time")
{
    if (!hasFigures())
        return;
    json single = plainRun(), broken = runOf("error", 1e-6, kBrokenPsnr), longer = runOf("depth", 1e6, 1e-3);
    single["per_frame"] = {{"wall_ms", {4}}, {"psnr", {nullptr}}, {"temporal", {nullptr}}, {"decoded", {0}}};
    single["config"]["shots"] = single["config"]["frames"] = 1;
    longer["config"]["shots"] = longer["config"]["frames"] = 3;
    broken["per_frame"]["psnr"] = {kBrokenPsnr, kBrokenPsnr};
    broken["accuracy"]["max_error"] = 1e30;
    broken["peak_bytes"] = 0;
    longer["per_frame"] = {{"wall_ms", {4, 4, 4}},
                           {"psnr", {nullptr, kBrokenPsnr, 3}},
                           {"temporal", {nullptr, 1, 0}},
                           {"decoded", {0, 1000000000, 3}}};
    const auto drawn = drawFigures(chartModel({parsed(broken), parsed(plainRun())}), [](size_t, size_t) {});
    CHECK(drawn[1].bytes.find(">broken<") != std::string::npos);
    CHECK(drawn[1].bytes.find(">equal<") != std::string::npos);
    const std::vector<std::vector<ChartRun>> cases = {
        {parsed(single)}, {parsed(broken)}, {parsed(plainRun())}, {parsed(single), parsed(broken), parsed(longer)}};
    for (const std::vector<ChartRun>& rows : cases)
        for (const FigureFile& file : drawFigures(chartModel(rows), [](size_t, size_t) {})) {
            if (!file.name.ends_with(".svg"))
                continue; // any bytes
            CAPTURE(file.name);
            CHECK(file.bytes.find("NaN") == file.bytes.npos);
            CHECK(file.bytes.find("Infinity") == file.bytes.npos);
            CHECK(file.bytes.find("undefined") == file.bytes.npos);
        }
}

TEST_CASE("axes do not zoom into noise")
{
    if (!hasFigures())
        return;
    json one = runOf("none", 20, 75.02), two = runOf("error", 20.1, 75.04);
    one["peak_bytes"] = uint64_t(54.04 * 1048576);
    two["peak_bytes"] = uint64_t(54.06 * 1048576);
    for (json* line : {&one, &two})
        (*line)["per_frame"]["temporal"] = {nullptr, 0.00001};
    const std::vector<ChartRun> rows = {parsed(one), parsed(two)};
    const std::string accuracy = svgOf(rows, "accuracy"), over_time = svgOf(rows, "over-time");
    for (const char* noise : {">54.", ">20.", ">75.", ">74.5<"})
        CHECK_MESSAGE(accuracy.find(noise) == accuracy.npos, noise);
    for (const char* round : {">50<", ">60<", ">18<", ">22<", ">72<", ">78<"})
        CHECK_MESSAGE(accuracy.find(round) != accuracy.npos, round);
    CHECK(over_time.find(">0.1<") != over_time.npos); // 1/255, what no 8-bit image shows
}

TEST_CASE("no text is cut off at the right or printed over another one")
{
    if (!hasFigures())
        return;
    std::vector<ChartRun> rows;
    for (int i = 0; i < 8; ++i) {
        json line = runOf(i % 2 ? "error" : "depth", 5 + i, 50 + i);
        line["config"]["max_depth"] = i;
        line["config"]["bound"] = 0.25 * i;
        line["config"]["guidance"] = i % 2 ? json() : json("exponential");
        line["config"]["decode_budget"] = i % 4 ? json() : json(71000);
        line["device"]["name"] = "Intel(R) Xeon(R) Processor of a wordy vendor, at 2.10 gigahertz";
        rows.push_back(parsed(line));
    }
    for (const char* kind : {"accuracy", "over-time"}) {
        const std::vector<Text> texts = textsOf(svgOf(rows, kind));
        CHECK(texts.size() > rows.size());
        for (const Text& text : texts) {
            CAPTURE(text.words);
            CHECK(text.x + text.width < 1000);
            for (const Text& other : texts)
                if (other.y == text.y && other.x > text.x)
                    CHECK(text.x + text.width < other.x);
        }
    }
}

TEST_CASE("a run has its colour in every figure")
{
    if (!hasFigures())
        return;
    json depth = runOf("depth", 3, 40), error = runOf("error", 2, 50);
    const std::vector<ChartRun> rows = {parsed(depth), parsed(error)};
    for (const char* kind : {"accuracy", "frame-time", "over-time"}) {
        CAPTURE(std::string(kind));
        const std::string svg = svgOf(rows, kind);
        CHECK(svg.find("#c36b25") != svg.npos); // the middle of the ramp of depth
        CHECK(svg.find("#307cc3") != svg.npos); // colour of error
    }
}

TEST_CASE("FLIP has plots of its own where a run knows it")
{
    if (!hasFigures())
        return;
    json known = runOf("none", 3, 40);
    const std::string without = svgOf({parsed(known), parsed(runOf("error", 6, 60))}, "accuracy");
    known["accuracy"]["flip"] = {{"mean", 0.02}, {"max", 0.03}, {"frames", 2}};
    const std::string with = svgOf({parsed(known), parsed(runOf("error", 6, 60))}, "accuracy");
    CHECK(without.find("FLIP") == without.npos);
    CHECK(with.find(">FLIP, mean<") != with.npos);
    CHECK(with.find(">0.02<") != with.npos); // its axis
    CHECK(with.find("NaN") == with.npos);
}

TEST_CASE("a run with foveation has a second point, hollow, for what it draws where the eye looks")
{
    if (!hasFigures())
        return;
    json thin = runOf("none", 3, 40);
    thin["config"]["fovea_pixels"] = 2;
    thin["accuracy"]["fovea"] = {{"inside", nullptr}, {"outside", nullptr}};
    const auto drawn = [&](const json& psnr) {
        json run = thin;
        if (!psnr.is_null())
            run["accuracy"]["fovea"]["inside"] = {
                {"share", 0.1}, {"psnr", {{"pooled", psnr}, {"min", psnr}, {"min_frame", 0}}}, {"flip_mean", nullptr}};
        return svgOf({parsed(run), parsed(runOf("none", 6, 60))}, "accuracy");
    };
    const std::string without = drawn(nullptr), with = drawn(83);
    CHECK(without.find("within 12") == without.npos); // no pixel of it is there
    CHECK(with.find("within 12") != with.npos);
    CHECK(with.find("foveation to 2 pixels") != with.npos);
    CHECK(without.find(">80<") == without.npos); // the axis of decibels holds the point
    CHECK(with.find(">80<") != with.npos);
}
