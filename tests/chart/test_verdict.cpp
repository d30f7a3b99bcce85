// SPDX-License-Identifier: Apache-2.0
// The verdict in words, and colours that stay the same on the whole page.
#include "convert/chart/chart_model.h"
#include "convert/chart/rows/run_set.h"
#include "tests/chart/run_lines.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <fstream>

using namespace gsc;
using nlohmann::json;

namespace {

std::string verdictOf(const std::vector<ChartRun>& rows)
{
    std::string text;
    const auto model = chartModel(rows);
    for (const auto& sentence : model["panels"][0]["verdict"]["sentences"])
        text += (text.empty() ? "" : " ") + sentence["run"].get<std::string>() + sentence["text"].get<std::string>();
    return text;
}

json errorRun(double bound, double ms, const json& psnr, const std::string& trajectory = "walk")
{
    json line = runOf("error", ms, psnr);
    line["config"]["bound"] = bound;
    line["config"]["trajectory"] = trajectory;
    return line;
}

} // namespace

TEST_CASE("verdict: the fastest run that keeps 50, 60 and 70 dB in the worst frame")
{
    CHECK(verdictOf({parsed(runOf("none", 6, nullptr)), parsed(errorRun(1, 3, 72)), parsed(errorRun(2, 4, 65))}) ==
          "error 1/255 is the fastest that keeps 50, 60 and 70 dB: 3.00 ms, 2.00 times as fast as none.");
    CHECK(verdictOf({parsed(runOf("none", 6, nullptr)), parsed(errorRun(1, 5, 60)), parsed(errorRun(4, 4, 50))}) ==
          "error 4/255 is the fastest that keeps 50 dB: 4.00 ms, 1.50 times as fast as none. "
          "error 1/255 is the fastest that keeps 60 dB: 5.00 ms, 1.20 times as fast as none. "
          "none is the fastest that keeps 70 dB: 6.00 ms.");
    CHECK(verdictOf({parsed(runOf("none", 120, 55)), parsed(errorRun(1, 100, 49.9))}) ==
          "none is the fastest that keeps 50 dB: 120 ms. No run keeps 60 or 70 dB; none comes nearest with 55.0 dB.");
    CHECK(verdictOf({parsed(runOf("none", 1, kBrokenPsnr))}) == "No run keeps 50, 60 or 70 dB.");
    // pooled decibels do not count
    json spiky = errorRun(1, 3, 30);
    spiky["accuracy"]["psnr"]["pooled"] = 90;
    const auto model = chartModel({parsed(runOf("none", 6, 65)), parsed(spiky)});
    CHECK(json(model["panels"][0]["verdict"]["floors"]) ==
          json::parse(R"([{"psnr":50,"row":0},{"psnr":60,"row":0},{"psnr":70,"row":null}])"));
}

TEST_CASE("without a run of policy none the page says why there is no speed-up")
{
    const ChartRun none = parsed(runOf("none", 6, nullptr)), walk = parsed(errorRun(1, 3, 72)),
                   orbit = parsed(errorRun(1, 3, 72, "orbit")), turn = parsed(errorRun(1, 3, 72, "turn"));
    CHECK(verdictOf({walk}) == "error 1/255 is the fastest that keeps 50, 60 and 70 dB: 3.00 ms.");
    CHECK(chartModel({none, walk})["no_baseline"] == "");
    CHECK(
        chartModel({none, walk, orbit, turn})["no_baseline"] ==
        "orbit, turn: no run has policy none and detail 0, so there is no speed-up to tell. Add {\"policy\": \"none\", "
        "\"detail\": 0} to the runs of the sweep, or a row of gsc-play bench without --reuse, --detail and "
        "--target-ms.");
    CHECK(chartModel({walk, orbit})["no_baseline"].get<std::string>().starts_with(
        "No run has policy none and detail 0, "));
}

TEST_CASE("detail: told in words, sped up against none, and no baseline itself")
{
    json coarse = runOf("none", 2, 55), reused = errorRun(1, 4, 60);
    coarse["config"]["detail"] = 2;
    const std::vector<ChartRun> both = {parsed(coarse), parsed(reused), parsed(runOf("none", 6, nullptr))};
    const auto model = chartModel(both);
    const auto& rows = model["panels"][0]["rows"];
    CHECK(rows[0]["name"] == "none, detail 2");
    CHECK(rows[0]["speedup"] == 3);
    CHECK(rows[0]["baseline"] == false);
    CHECK(rows[1]["speedup"] == 1.5);
    CHECK(rows[2]["name"] == "none");
    CHECK(rows[2]["baseline"] == true);
    CHECK(verdictOf(both) == "none, detail 2 is the fastest that keeps 50 dB: 2.00 ms, 3.00 times as fast as none. "
                             "error 1/255 is the fastest that keeps 60 dB: 4.00 ms, 1.50 times as fast as none. "
                             "none is the fastest that keeps 70 dB: 6.00 ms.");
    const auto without = chartModel({both[0], both[1]});
    CHECK(without["panels"][0]["rows"][0]["baseline"] == false);
    CHECK(without["panels"][0]["rows"][1]["speedup"].is_null());
    CHECK(without["no_baseline"].get<std::string>().starts_with("No run has policy none and detail 0, "));
}

TEST_CASE("verdict: a sentence has the options to type, all that draw so and no others")
{
    json run = errorRun(1.5, 3, 72);
    json& config = run["config"];
    CHECK(chartModel({parsed(run)})["panels"][0]["verdict"]["sentences"][0]["options"] ==
          "--tier fast --reuse error --reuse-bound 1.5");
    config["decode_budget"] = 4000;
    config["cache_budget"] = 1 << 30;
    config["lod_bias"] = -0.5;
    config["lod_fade"] = 0.25;
    config["lod_hysteresis"] = 0.125;
    config["fovea_pixels"] = 4;
    config["eyes"] = 2;
    config["stereo"] = "merged";
    config["threads"] = 2;
    config["vram_budget"] = 8ULL << 30;
    CHECK(chartModel({parsed(run)})["panels"][0]["verdict"]["sentences"][0]["options"] ==
          "--tier fast --reuse error --reuse-bound 1.5 --decode-budget 4000 --cache-budget 1073741824 --lod-bias -0.5 "
          "--lod-fade 0.25 --lod-hysteresis 0.125 --foveation fixed --fovea-pixels 4 --eyes 2 --stereo merged "
          "--threads 2 "
          "--vram-budget 8589934592");
    json detail = runOf("none", 3, 72), depth = runOf("depth", 2, 40);
    detail["config"]["detail"] = 2;
    detail["config"]["cache_budget"] =
        4096; // a command whose other runs reuse anchors states it; refused without reuse
    depth["config"]["max_depth"] = 10;
    depth["config"]["guidance"] = "linear";
    const auto model = chartModel({parsed(detail), parsed(depth)});
    const auto& sentences = model["panels"][0]["verdict"]["sentences"];
    CHECK(sentences[0]["options"] == "--tier fast --detail 2");
    CHECK(chartModel({parsed(runOf("none", 3, 40))})["panels"][0]["verdict"]["sentences"][0]["options"] == "");
    depth["accuracy"]["psnr"]["min"] = 55;
    CHECK(chartModel({parsed(depth)})["panels"][0]["verdict"]["sentences"][0]["options"] ==
          "--tier fast --reuse depth --reuse-depth 10 --reuse-guidance linear");
}

TEST_CASE("verdict: repeats are told, and that a difference is within their spread")
{
    ChartRun none = parsed(runOf("none", 6, nullptr)), error = parsed(errorRun(1, 3, 72));
    error.rounds = 3;
    error.least_ms = 2.5;
    error.most_ms = 4;
    const std::string clear = "error 1/255 is the fastest that keeps 50, 60 and 70 dB: 3.00 ms (2.50 to 4.00 in 3 "
                              "repeats), 2.00 times as fast as none";
    CHECK(verdictOf({none, error}) == clear + ".");
    error.most_ms = 6;
    const auto model = chartModel({none, error});
    CHECK(verdictOf({none, error})
              .ends_with("in 3 repeats), no difference from none: it lies within the scatter of the repeats."));
    CHECK(model["panels"][0]["rows"][0]["repeats"].is_null());
    CHECK(json(model["panels"][0]["rows"][1]["repeats"]) == json::parse(R"({"count":3,"min":2.5,"max":6})"));
}

TEST_CASE("verdict: what a run keeps it keeps in every repeat, and its speed-up is that of the middle")
{
    RunSet runs;
    const json none = runOf("none", 6, 60), error = errorRun(1, 2, 65);
    const auto add = [&](json line, double ms, double psnr) {
        line["ms"]["wall"]["median"] = ms;
        line["per_frame"]["wall_ms"] = {ms, ms};
        line["accuracy"]["psnr"]["min"] = psnr;
        addRuns(line.dump(), "a", runs);
    };
    add(none, 6, 60);
    add(none, 10, 60);
    add(error, 1, 49.5);
    add(error, 3, 65);
    foldRepeats(runs);
    const auto model = chartModel(runs.rows);
    const auto& row = model["panels"][0]["rows"][1];
    CHECK(row["ms"]["median"] == 2);
    CHECK(row["speedup"] == 4);
    CHECK(row["min"] == 49.5);
    CHECK(verdictOf(runs.rows) == "none is the fastest that keeps 50 and 60 dB: 8.00 ms (6.00 to 10.0 in 2 repeats). "
                                  "No run keeps 70 dB; none comes nearest with 60.0 dB.");
}

TEST_CASE("one policy has one hue and one configuration one look, whatever the panel and the order of speed")
{
    std::vector<ChartRun> rows;
    for (const char* trajectory : {"walk", "orbit"}) {
        const bool first = rows.empty();
        json none = runOf("none", 9, nullptr), budget = errorRun(1, first ? 7 : 3, 40, trajectory);
        none["config"]["trajectory"] = trajectory;
        budget["config"]["decode_budget"] = first ? 100 : 200; // number that "match" becomes
        rows.push_back(parsed(none));
        rows.push_back(parsed(errorRun(0.5, first ? 3 : 6, 60, trajectory)));
        rows.push_back(parsed(errorRun(4, first ? 5 : 2, 50, trajectory)));
        rows.push_back(parsed(budget));
    }
    rows.insert(rows.begin() + 4, parsed(runOf("depth", 4, 45))); // in the first alone
    const auto model = chartModel(rows);
    const auto &walk = model["panels"][0]["rows"], &orbit = model["panels"][1]["rows"];
    REQUIRE(walk.size() == 5);
    REQUIRE(orbit.size() == 4);
    for (size_t i = 0; i < orbit.size(); ++i)
        for (const char* key : {"hue", "shade", "dash"})
            CHECK(walk[i][key] == orbit[i][key]);
    CHECK(walk[0]["hue"] == 0);
    CHECK(walk[4]["hue"] == 1);
    for (size_t i = 1; i < 4; ++i) {
        CHECK(walk[i]["hue"] == 2);
        CHECK(walk[i]["shade"] == 0.5 * double(i - 1));
    }
}

TEST_CASE("detail has a hue and a symbol of its own, with a decode of everything as its baseline")
{
    json detail = runOf("none", 3, 50);
    detail["config"]["detail"] = 2;
    const auto model = chartModel({parsed(detail), parsed(runOf("none", 6, 80)), parsed(runOf("other", 6, 80))});
    const auto& rows = model["panels"][0]["rows"];
    CHECK(rows[0]["method"] == "detail");
    CHECK(rows[0]["hue"] == 3);
    CHECK(rows[0]["speedup"] == 2);
    CHECK(rows[1]["method"] == "none");
    CHECK(rows[1]["hue"] == 0);
    CHECK(rows[1]["baseline"] == true);
    CHECK(rows[2]["hue"] == 4);
}

TEST_CASE("a model that was baked stands beside the one that it is held against, and is no baseline")
{
    json baked = runOf("none", 3, 50);
    baked["reference_file"] = baked["file"];
    baked["file"] = {{"path", "models/fox55.gsc"}, {"bytes", 4000}, {"anchors", 26000}};
    const auto model = chartModel({parsed(baked), parsed(runOf("none", 6, 80))});
    REQUIRE(model["panels"].size() == 1);
    const auto& rows = model["panels"][0]["rows"];
    CHECK(rows[0]["name"] == "none, of fox55.gsc");
    CHECK(rows[0]["baseline"] == false);
    CHECK(rows[0]["speedup"] == 2);
    RunSet both; // held against itself it is another run
    json itself = baked;
    itself.erase("reference_file");
    both.rows = {parsed(baked), parsed(itself)};
    foldRepeats(both);
    CHECK(both.rows.size() == 2);
}

TEST_CASE("the sweeps that README charts hold a run without reuse")
{
    for (const char* name : {"policies", "reuse", "device", "device_reuse", "levels", "foveation"}) {
        CAPTURE(name);
        std::ifstream file(std::string(GSC_SWEEPS) + "/" + name + ".json");
        const json config = json::parse(file);
        const json axis = config.value("axes", json::object()).value("policy", json::array({"none"}));
        bool found = config.contains("axes") && std::count(axis.begin(), axis.end(), json("none"));
        for (const json& run : config.value("runs", json::array()))
            found |= run.value("policy", "none") == "none";
        CHECK(found);
    }
}
