// SPDX-License-Identifier: Apache-2.0
// Front, speed-up, names and panels of the page's data.
#include "convert/chart/chart_model.h"
#include "convert/chart/pareto.h"
#include "convert/chart/run_words.h"
#include "tests/chart/run_lines.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <limits>
#include <random>
#include <set>

using namespace gsc;
using nlohmann::json;

namespace {

constexpr double kEqual = std::numeric_limits<double>::infinity();
using Indices = std::vector<size_t>;

Indices indices(const nlohmann::ordered_json& list)
{
    return list.get<Indices>();
}

} // namespace

TEST_CASE("paretoFront: what nothing beats, fastest first")
{
    CHECK(paretoFront({}).empty());
    CHECK(paretoFront(std::vector<SpeedAccuracy>{{3, 40}}) == Indices{0});
    // 1 is slower and worse than 2; 3 as fast as 2 but worse; 4 equal images
    CHECK(paretoFront(std::vector<SpeedAccuracy>{{1, 30}, {3, 39}, {2, 40}, {2, 35}, {9, kEqual}}) == Indices{0, 2, 4});
    // as accurate but slower is beaten; equal in both stays
    CHECK(paretoFront(std::vector<SpeedAccuracy>{{2, 40}, {1, 40}, {1, 40}}) == Indices{1, 2});
    CHECK(paretoFront(std::vector<SpeedAccuracy>{{2, kEqual}, {1, kEqual}}) == Indices{1});
}

TEST_CASE("paretoFront: agrees with the definition on random points")
{
    std::mt19937 random(7);
    for (int trial = 0; trial < 300; ++trial) {
        std::vector<SpeedAccuracy> points(random() % 30);
        for (SpeedAccuracy& point : points)
            point = {double(random() % 8), random() % 9 == 0 ? kEqual : double(random() % 8)};
        std::set<size_t> expected;
        for (size_t i = 0; i < points.size(); ++i) {
            bool beaten = false;
            for (const SpeedAccuracy& other : points)
                beaten |= other.ms <= points[i].ms && other.psnr >= points[i].psnr &&
                          (other.ms < points[i].ms || other.psnr > points[i].psnr);
            if (!beaten)
                expected.insert(i);
        }
        const Indices front = paretoFront(points);
        CHECK(std::set<size_t>(front.begin(), front.end()) == expected);
        for (size_t i = 1; i < front.size(); ++i)
            CHECK(points[front[i - 1]].ms <= points[front[i]].ms);
    }
}

TEST_CASE("thinned: ends stay")
{
    CHECK(thinned({4, 5, 6}, 3) == Indices{4, 5, 6});
    CHECK(thinned({1, 2, 3, 4, 5, 6, 7}, 3) == Indices{1, 4, 7});
    CHECK(thinned({1, 2, 3}, 1) == Indices{1});
    CHECK(thinned({1, 2}, 0).empty());
}

TEST_CASE("speed-up is against none of the same tier and trajectory")
{
    json exact = runOf("none", 12, nullptr), turn = runOf("none", 100, 60), other = runOf("error", 1, 30);
    exact["config"]["tier"] = "exact";
    turn["config"]["trajectory"] = "turn";
    other["config"]["tier"] = "of another version";
    json more = runOf("none", 7, 60); // none, but not plain: only the baseline if there is no plainer one
    more["config"]["lod_bias"] = 1;
    const auto model = chartModel({parsed(more), parsed(runOf("error", 2, 50)), parsed(runOf("none", 6, 60)),
                                   parsed(exact), parsed(turn), parsed(other)});
    REQUIRE(model["panels"].size() == 2);
    const auto& rows = model["panels"][0]["rows"];
    CHECK(rows[1]["speedup"] == 3);
    CHECK(rows[2]["speedup"] == 1);
    CHECK(rows[2]["baseline"] == true);
    CHECK(rows[0]["baseline"] == false);
    CHECK(rows[0]["speedup"].get<double>() == doctest::Approx(6.0 / 7).epsilon(1e-4));
    CHECK(rows[3]["speedup"] == 1);
    CHECK(rows[3]["baseline"] == true);
    CHECK(rows[4]["speedup"].is_null()); // it was not measured without reuse
    CHECK(model["panels"][1]["rows"][0]["speedup"] == 1);
    CHECK(indices(model["panels"][0]["views"]["min"]["front"]) == Indices{4, 1, 2, 3});
}

TEST_CASE("foveation: named by its pixels, measured against the run without it, with what lies where")
{
    json thin = runOf("none", 3, 40), finer = runOf("none", 4, 45);
    thin["config"]["fovea_pixels"] = 2;
    thin["accuracy"]["fovea"] = json::parse(R"({
        "inside": {"share": 0.0625, "psnr": {"pooled": 80.5, "min": null, "min_frame": 0}, "flip_mean": 0.0015},
        "outside": {"share": 0.9375, "psnr": {"pooled": 39, "min": 37, "min_frame": 1}, "flip_mean": null}})");
    finer["config"]["fovea_pixels"] = 1.5;
    finer["accuracy"]["fovea"] = thin["accuracy"]["fovea"];
    finer["accuracy"]["fovea"]["inside"] = nullptr;
    const auto model = chartModel({parsed(finer), parsed(thin), parsed(runOf("none", 6, 60))});
    REQUIRE(model["panels"].size() == 1);
    const auto& rows = model["panels"][0]["rows"];
    CHECK(rows[0]["name"] == "none, foveation to 1.5 pixels");
    CHECK(rows[1]["name"] == "none, foveation to 2 pixels");
    CHECK(rows[2]["name"] == "none");
    CHECK(rows[1]["speedup"] == 2);
    CHECK(rows[1]["baseline"] == false);
    CHECK(rows[2]["baseline"] == true);
    CHECK(rows[0]["fovea"]["inside"].is_null());
    CHECK(json(rows[1]["fovea"]["inside"]) == json{{"pooled", 80.5}, {"min", nullptr}, {"flip", 0.0015}});
    CHECK(json(rows[1]["fovea"]["outside"]) == json{{"pooled", 39}, {"min", 37}, {"flip", nullptr}});
    CHECK(rows[2]["fovea"].is_null());
    CHECK(rows[0]["shade"] != rows[1]["shade"]);
}

TEST_CASE("a run with other threads or memory bound has no baseline among the rest")
{
    json threads = runOf("error", 3, 50), bound = runOf("error", 3, 50);
    threads["config"]["threads"] = 4;
    bound["config"]["vram_budget"] = 1024;
    const auto model = chartModel({parsed(runOf("none", 6, 60)), parsed(threads), parsed(bound)});
    for (size_t i = 1; i < 3; ++i)
        CHECK(model["panels"][0]["rows"][i]["speedup"].is_null());
}

TEST_CASE("equal images are null in the model and still the most accurate")
{
    const auto model = chartModel({parsed(runOf("error", 2, 50)), parsed(runOf("none", 6, nullptr))});
    const auto& panel = model["panels"][0];
    CHECK(panel["rows"][1]["min"].is_null());
    CHECK(panel["rows"][1]["frames"]["psnr"][0].is_null());
    CHECK(indices(panel["views"]["min"]["front"]) == Indices{0, 1});
    CHECK(indices(panel["views"]["pooled"]["front"]) == Indices{0, 1});
}

TEST_CASE("the front of the worst frame is not that of all frames")
{
    json steady = runOf("error", 4, 50), spiky = runOf("depth", 3, 30);
    spiky["accuracy"]["psnr"]["pooled"] = 60;
    steady["accuracy"]["psnr"]["pooled"] = 55;
    const auto model = chartModel({parsed(steady), parsed(spiky)});
    CHECK(indices(model["panels"][0]["views"]["min"]["front"]) == Indices{1, 0});
    CHECK(indices(model["panels"][0]["views"]["pooled"]["front"]) == Indices{1});
}

TEST_CASE("names say what differs, common words are said once, equal names are told apart")
{
    json depth = runOf("depth", 3, 40), error = runOf("error", 3, 45), budget = runOf("error", 3, 44);
    depth["config"]["max_depth"] = 10;
    depth["config"]["guidance"] = "staged";
    error["config"]["bound"] = 0.5;
    budget["config"]["bound"] = 0.5;
    budget["config"]["decode_budget"] = 20480;
    const auto model = chartModel({parsed(depth), parsed(error), parsed(budget), parsed(error)});
    const auto& rows = model["panels"][0]["rows"];
    CHECK(rows[0]["name"] == "depth 10 staged");
    CHECK(rows[1]["name"] == "error 0.5/255");
    CHECK(rows[2]["name"] == "error 0.5/255, decode budget 20480");
    CHECK(rows[3]["name"] == "error 0.5/255 (2)");
    const auto words = model["panels"][0]["words"].get<std::string>();
    CHECK(words.find("every run: tier fast, cold start, gsc-play 0.1.0 (0a1b2c3)") != std::string::npos);
    CHECK(words.find("640x480, 1 eye") != std::string::npos);
}

TEST_CASE("runs of other images are not compared; titles say what sets panels of one trajectory apart")
{
    json two = plainRun(), device = plainRun(), turn = plainRun(), same_name = plainRun();
    two["config"]["eyes"] = 2;
    two["config"]["ipd"] = 0.064;
    device["device"]["name"] = "H200";
    turn["config"]["trajectory"] = "turn";
    same_name["file"]["path"] = "others/fox.gsc";
    const auto model = chartModel({parsed(plainRun()), parsed(two), parsed(device), parsed(turn), parsed(same_name)});
    REQUIRE(model["panels"].size() == 5);
    CHECK(model["panels"][0]["title"] == "walk, EPYC, 1 eye");
    CHECK(model["panels"][1]["title"] == "walk, EPYC, 2 eyes, eyes 0.064 apart");
    CHECK(model["panels"][2]["title"] == "walk, H200, 1 eye");
    CHECK(model["panels"][3]["title"] == "turn");
    CHECK(model["panels"][4]["title"] == "walk, EPYC, 1 eye (2)");
    CHECK(model["panels"][1]["file_name"] == "walk-EPYC-2-eyes-eyes-0-064-apart");
}

TEST_CASE("file names are plain and never meet")
{
    CHECK(fileNameOf("../../etc/passwd") == "etc-passwd");
    CHECK(fileNameOf("\xc3\xa9\xc3\xa9") == "run");
    CHECK(fileNameOf(std::string(500, 'a')).size() == 60);
    json a = plainRun(), b = plainRun();
    a["config"]["trajectory"] = "a/b";
    b["config"]["trajectory"] = "a b";
    const auto model = chartModel({parsed(a), parsed(b)});
    CHECK(model["panels"][0]["file_name"] == "a-b");
    CHECK(model["panels"][1]["file_name"] == "a-b-2");
}

TEST_CASE("of many runs the baselines and the front get a colour, no more than can be told apart")
{
    std::vector<ChartRun> rows;
    for (int i = 0; i < 200; ++i)
        rows.push_back(parsed(runOf("error", 1 + 0.1 * i, 20 + 0.3 * (i % 7 == 0 ? i : i / 2.0))));
    rows.push_back(parsed(runOf("none", 30, nullptr)));
    const auto model = chartModel(rows);
    const auto& view = model["panels"][0]["views"]["min"];
    const Indices front = indices(view["front"]), shown = indices(view["shown"]);
    CHECK(front.size() > 2 * kMaxShown);
    CHECK(shown.size() == kMaxShown);
    CHECK(shown.back() == 200);
    CHECK(shown.front() == front.front());
    for (const size_t row : shown)
        CHECK(std::find(front.begin(), front.end(), row) != front.end());
}

TEST_CASE("a policy that the front leaves out is still shown with its own best")
{
    std::vector<ChartRun> rows = {parsed(runOf("none", 1, nullptr))}; // beats everything
    for (int i = 0; i < 10; ++i) {
        rows.push_back(parsed(runOf("depth", 2 + i, 40 - (i == 0 ? 0 : 5)))); // the first beats the rest
        rows.push_back(parsed(runOf("error", 2 + i, 30 + i)));                // all on a front of their own
    }
    const auto model = chartModel(rows);
    CHECK(indices(model["panels"][0]["views"]["min"]["front"]) == Indices{0});
    CHECK(indices(model["panels"][0]["views"]["min"]["shown"]) == Indices{0, 1, 2, 10, 20});
}

TEST_CASE("broken images never make the front, however fast")
{
    const auto model = chartModel({parsed(runOf("error", 1, kBrokenPsnr)), parsed(runOf("none", 6, 60))});
    CHECK(indices(model["panels"][0]["views"]["min"]["front"]) == Indices{1});
    CHECK(model["panels"][0]["rows"][0]["min"] == kBrokenPsnr);
    CHECK(indices(chartModel({parsed(runOf("error", 1, kBrokenPsnr))})["panels"][0]["views"]["min"]["front"]).empty());
}

TEST_CASE("a tier that the backend draws as another says so")
{
    json fast = runOf("none", 3, 60), exact = runOf("none", 3, nullptr);
    fast["rendered_tier"] = "exact";
    exact["config"]["tier"] = exact["rendered_tier"] = "exact";
    const auto model = chartModel({parsed(fast), parsed(exact)});
    CHECK(model["panels"][0]["rows"][0]["name"] == "none, tier fast drawn as exact");
    CHECK(model["panels"][0]["rows"][1]["name"] == "none, tier exact");
}

TEST_CASE("runs that were not scored have times and speed-ups, and no place on the front")
{
    json none = runOf("none", 6, 60), fast = runOf("depth", 3, 60);
    fast.erase("accuracy");
    const auto model = chartModel({parsed(none), parsed(fast)});
    const auto& row = model["panels"][0]["rows"][1];
    CHECK(row["scored"] == false);
    CHECK(row["speedup"] == 2);
    CHECK(indices(model["panels"][0]["views"]["min"]["front"]) == Indices{0});
    none.erase("accuracy");
    const auto verdict = chartModel({parsed(none), parsed(fast)})["panels"][0]["verdict"];
    for (const auto& floor : verdict["floors"])
        CHECK(floor["row"].is_null());
    CHECK(verdict["sentences"][0]["text"].get<std::string>().starts_with("No run was scored against exact"));
}

TEST_CASE("a run with a time target or other frames in flight is no baseline")
{
    json target = runOf("none", 9, nullptr), plain = runOf("none", 6, nullptr), detail = runOf("none", 2, 40),
         two = runOf("none", 3, nullptr);
    target["config"]["target_ms"] = 5;
    detail["config"]["detail"] = 2;
    two["config"]["frames_in_flight"] = 2;
    const auto model = chartModel({parsed(target), parsed(plain), parsed(detail), parsed(two)});
    const auto& rows = model["panels"][0]["rows"];
    CHECK(rows[0]["baseline"] == false);
    CHECK(rows[1]["baseline"] == true);
    CHECK(rows[2]["speedup"] == 3);
    CHECK(rows[3]["speedup"] == 1); // its own baseline
}
