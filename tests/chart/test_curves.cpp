// SPDX-License-Identifier: Apache-2.0
// Lines of gsc.curve/1, as `gsc bake --curve` writes them and wrote them before.
#include "convert/chart/curve_model.h"
#include "convert/chart/rows/curve_set.h"
#include <gsc/error.h>

#include <doctest/doctest.h>

using namespace gsc;
using nlohmann::json;

namespace {

json plainLine()
{
    return json::parse(R"({
        "schema": "gsc.curve/1", "tool": {"name": "gsc", "version": "0.1.0", "commit": null}, "model": "fox",
        "device": "cuda:0", "tier": "exact", "most_pixels": 1000000, "model_anchors": 1000, "target_psnr": null,
        "anchors": 1000, "bytes": 300000, "archive_bytes": 200000, "resident_bytes": 400000, "frame_ms": 2.5,
        "decode_ms": 1.5, "poses": 16, "psnr": null, "worst_psnr": null, "worst": "a.png", "ssim": 1, "worst_ssim": 1,
        "flip": 0, "worst_flip": 0})");
}

std::vector<ChartCurve> curvesOf(const json& line)
{
    std::vector<ChartCurve> curves;
    addCurves(line.dump() + "\n", "fox.jsonl", curves);
    return curves;
}

} // namespace

TEST_CASE("a curve tells the milliseconds of detail, and one that does not is read as before")
{
    json line = plainLine();
    const auto detailOf = [&line] {
        return curveModel(curvesOf(line))["panels"][0]["curves"][0]["points"][0]["detail"];
    };
    CHECK(detailOf().is_null());
    line["detail_ms"] = {{"0", 4}, {"1", 3.5}, {"2", 2.25}, {"4", 2}};
    CHECK(detailOf() == json::parse("[4, 3.5, 2.25, 2]"));
    CurveRow row = curvesOf(line)[0].rows[0];
    CHECK(toJson(row)["detail_ms"].dump() == R"({"0":4.0,"1":3.5,"2":2.25,"4":2.0})");
}

TEST_CASE("milliseconds of detail that lack one or are no numbers are refused")
{
    for (const json& wrong : {json{{"0", 4}, {"1", 3}, {"2", 2}}, json{{"0", 4}, {"1", 3}, {"2", 2}, {"4", -1}},
                              json{{"0", 4}, {"1", 3}, {"2", nullptr}, {"4", 1}}, json::array({4, 3, 2, 1}), json()}) {
        json line = plainLine();
        line["detail_ms"] = wrong;
        CAPTURE(wrong.dump());
        try {
            (void)curvesOf(line);
            FAIL("was read");
        } catch (const Error& error) {
            CHECK(error.code() == ErrorCode::InvalidFile);
            CHECK(std::string(error.what()).find("fox.jsonl:1: detail_ms is ") != std::string::npos);
        }
    }
}
