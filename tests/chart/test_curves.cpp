// SPDX-License-Identifier: Apache-2.0
// Rows of curves, as `gsc bake --curve` writes them.
#include "convert/chart/curve_model.h"
#include "convert/chart/rows/run_set.h"
#include "tests/chart/run_lines.h"
#include <gsc/error.h>

#include <doctest/doctest.h>

using namespace gsc;
using nlohmann::json;

namespace {

json curveRow(const json& target, uint64_t archive_bytes)
{
    json line = plainRun();
    line["tool"]["name"] = "gsc";
    line["file"]["path"] = "fox";
    line["curve"] = {{"target_psnr", target},  {"model_anchors", 1000},
                     {"most_pixels", 1000000}, {"archive_bytes", archive_bytes},
                     {"worst_pose", "a.png"},  {"detail_ms", {{"0", 4}, {"1", 3.5}, {"2", 2.25}, {"4", 2}}}};
    return line;
}

RunSet rowsOf(const std::vector<json>& lines)
{
    RunSet runs;
    for (const json& line : lines)
        addRuns(line.dump(), "fox.jsonl", runs);
    return runs;
}

std::string refusal(const std::vector<json>& lines)
{
    try {
        (void)rowsOf(lines);
    } catch (const Error& error) {
        CHECK(error.code() == ErrorCode::InvalidFile);
        return error.what();
    }
    return "accepted";
}

} // namespace

TEST_CASE("rows of a model and its targets make a curve, and no runs")
{
    const RunSet runs = rowsOf({curveRow(nullptr, 200000), curveRow(40, 100000)});
    CHECK(runs.rows.empty());
    REQUIRE(runs.curves.size() == 1);
    const auto points = curveModel(runs.curves)["panels"][0]["curves"][0]["points"];
    CHECK(points[0]["target"].is_null());
    CHECK(points[1]["target"] == 40);
    CHECK(points[1]["per_anchor"] == 100);
    CHECK(points[1]["frame"] == 3);
    CHECK(points[1]["detail"] == json::parse("[4, 3.5, 2.25, 2]"));
    CHECK(toJson(runs.curves[0].rows[0])["curve"]["detail_ms"].dump() == R"({"0":4.0,"1":3.5,"2":2.25,"4":2.0})");
}

TEST_CASE("a curve without the model itself, a target twice and one without a score are refused")
{
    CHECK(refusal({curveRow(40, 1)}).find("fox at 40 dB, expected a line of the model itself") != std::string::npos);
    const json model = curveRow(nullptr, 2), fine = curveRow(40, 1);
    CHECK(refusal({model, fine, fine}).find("has such a line already") != std::string::npos);
    json unscored = model;
    unscored.erase("accuracy");
    CHECK(refusal({unscored}).find("has no accuracy") != std::string::npos);
}

TEST_CASE("milliseconds of detail that lack one or are no numbers are refused")
{
    for (const json& wrong : {json{{"0", 4}, {"1", 3}, {"2", 2}}, json{{"0", 4}, {"1", 3}, {"2", 2}, {"4", -1}},
                              json{{"0", 4}, {"1", 3}, {"2", nullptr}, {"4", 1}}, json::array({4, 3, 2, 1}), json()}) {
        json line = curveRow(nullptr, 1);
        line["curve"]["detail_ms"] = wrong;
        CAPTURE(wrong.dump());
        CHECK(refusal({line}).starts_with("fox.jsonl:1: curve.detail_ms is "));
    }
}
