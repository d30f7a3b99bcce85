// SPDX-License-Identifier: Apache-2.0
// Reading runs: what is taken, what is refused and how it is said.
#include "convert/chart/rows/run_set.h"
#include <gsc/error.h>
#include "tests/chart/run_lines.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

using namespace gsc;
using nlohmann::json;

namespace {

std::string refusal(const std::string& text, ErrorCode code = ErrorCode::InvalidFile)
{
    RunSet runs;
    try {
        addRuns(text, "runs.jsonl", runs);
    } catch (const Error& error) {
        CHECK(error.code() == code);
        return error.what();
    }
    return "accepted";
}

} // namespace

TEST_CASE("a run is read as it is written; null decibels are infinite")
{
    json line = runOf("error", 2.5, 41.25);
    line["config"]["bound"] = 0.5;
    line["per_frame"]["psnr"] = {nullptr, 41.25};
    const ChartRun row = parsed(line);
    CHECK(row.config.reuse.policy == "error");
    CHECK(row.config.reuse.bound == 0.5);
    CHECK(row.config.size[0] == 640);
    CHECK(row.ms.wall.median == 2.5);
    CHECK(row.ms.wall.p99 == 6);
    CHECK(row.ms.stages[kDecodeStage].median == 1.25);
    CHECK(row.accuracy->psnr_min == 41.25);
    CHECK(std::isinf(row.accuracy->frame_psnr[0]));
    CHECK(row.accuracy->frame_psnr[1] == 41.25);
    CHECK(std::isnan(row.accuracy->frame_temporal[0]));
    CHECK(row.decoded == std::vector<uint64_t>{10, 10});
    CHECK(std::isinf(parsed(plainRun()).accuracy->psnr_pooled));
    CHECK(row.accuracy->ssim.frames == 0);
}

TEST_CASE("blank lines count, other known forms are skipped and told")
{
    RunSet runs;
    const std::string good = plainRun().dump();
    addRuns("\n" + good + "\r\n{\"schema\":\"gsc.play/1\"}\n  \n{\"schema\":\"gsc.play/1\"}\n" + good, "a.jsonl", runs);
    CHECK(runs.rows.size() == 2);
    CHECK(runs.skipped == 2);
    REQUIRE(runs.notes.size() == 1);
    CHECK(runs.notes[0] == "a.jsonl: skipped 2 lines of gsc.play/1, which gsc chart does not draw");
}

TEST_CASE("a broken line is refused by file, number and place")
{
    const std::string good = plainRun().dump() + "\n";
    CHECK(refusal(good + good + "{\"schema\": \"gsc.run/2\",").starts_with("runs.jsonl:3: is not JSON"));
    CHECK(refusal("\xff\xfe").starts_with("runs.jsonl:1: is not JSON"));
    CHECK(refusal("[1]").find("expected an object") != std::string::npos);
    CHECK(refusal("{}").starts_with("runs.jsonl:1: has no schema"));
    CHECK(refusal("{\"schema\":\"other/1\"}").find("\"other/1\", expected gsc.run/2") != std::string::npos);
    CHECK(refusal("{\"schema\":\"gsc.run/3\"}", ErrorCode::Unsupported) ==
          "runs.jsonl:1: schema is gsc.run/3, expected gsc.run/2; use the version of the program that wrote it");
}

TEST_CASE("every field the charts need is required and checked")
{
    for (const char* pointer : {"/tool",
                                "/label",
                                "/file/path",
                                "/backend",
                                "/device/name",
                                "/config/policy",
                                "/config/tier",
                                "/config/frames",
                                "/config/size",
                                "/ms/wall/median",
                                "/ms/stages/decode",
                                "/accuracy/psnr/min",
                                "/reuse/hit_rate",
                                "/peak_bytes",
                                "/per_frame/psnr",
                                "/per_frame/decoded",
                                "/rendered_tier",
                                "/config/detail",
                                "/config/shots",
                                "/config/target_ms",
                                "/accuracy/scored",
                                "/accuracy/pop",
                                "/warnings",
                                "/repeats",
                                "/reference"}) {
        CAPTURE(pointer);
        json line = plainRun();
        const json::json_pointer place(pointer);
        line.at(place.parent_pointer()).erase(place.back());
        std::string path = place.to_string().substr(1);
        std::replace(path.begin(), path.end(), '/', '.');
        CHECK(refusal(line.dump()).starts_with("runs.jsonl:1: has no " + path + ","));
    }
    const std::pair<const char*, json> wrong[] = {{"/config/eyes", 3},
                                                  {"/config/eyes", 1.5},
                                                  {"/config/frames", 0},
                                                  {"/config/policy", ""},
                                                  {"/config/size", {640}},
                                                  {"/config/size", {0, 480}},
                                                  {"/config/bound", -1},
                                                  {"/ms/wall/median", "4"},
                                                  {"/ms/wall/p99", -4},
                                                  {"/ms/wall/max", nullptr},
                                                  {"/accuracy/psnr/min", "inf"},
                                                  {"/accuracy/max_error", -1},
                                                  {"/peak_bytes", -1},
                                                  {"/per_frame/psnr", {1}},
                                                  {"/per_frame/wall_ms", json::array()},
                                                  {"/per_frame/psnr", {1, "x"}},
                                                  {"/per_frame/decoded", "no"},
                                                  {"/file/bytes", 1e300},
                                                  {"/config/trajectory", json()},
                                                  {"/reuse", json::array()}};
    for (const auto& [pointer, value] : wrong) {
        CAPTURE(pointer);
        CAPTURE(value.dump());
        json line = plainRun();
        line.at(json::json_pointer(pointer)) = value;
        CHECK(refusal(line.dump()).find(", expected ") != std::string::npos);
    }
}

TEST_CASE("rows of an earlier version are refused with the command that makes new ones")
{
    for (const auto& [kind, command] :
         {std::pair("run", "gsc-play bench MODEL.gsc --sweep SWEEP.json --out RUNS.jsonl"),
          std::pair("bench", "gsc-play bench MODEL.gsc --out RUNS.jsonl"),
          std::pair("stability", "gsc-play stability MODEL.gsc --trajectories PATHS --format json > RUNS.jsonl"),
          std::pair("curve", "gsc bake MODEL.gsc --curve 60,50,40 -o CURVE.jsonl")}) {
        const std::string schema = std::string("gsc.") + kind + "/1";
        CHECK(refusal("{\"schema\":\"" + schema + "\"}", ErrorCode::Unsupported) ==
              "runs.jsonl:1: schema is " + schema + ", of an earlier version, expected gsc.run/2; make new rows with " +
                  command);
    }
}

TEST_CASE("a run that was not scored is one all the same, and one with some frames scored tells which")
{
    json line = plainRun();
    line.erase("accuracy");
    CHECK(refusal(line.dump()) == "accepted");
    line["per_frame"].erase("psnr");
    line["per_frame"].erase("temporal");
    line["reference"] = nullptr;
    CHECK_FALSE(parsed(line).accuracy);
    CHECK(parsed(line).reference.empty());
    line = plainRun();
    line["accuracy"]["scored"] = {{"listed", {1}}};
    line["per_frame"]["psnr"] = {nullptr};
    line["per_frame"]["temporal"] = {nullptr};
    CHECK(parsed(line).accuracy->scored.frameOf(0) == 1);
    line["accuracy"]["scored"]["listed"] = {1, 1};
    CHECK(refusal(line.dump()).find("expected ascending numbers of frames") != std::string::npos);
}

TEST_CASE("a run measured again is a repeat: the one in the middle stands for all, with their spread")
{
    RunSet runs;
    const auto measured = [](json line, double ms) {
        line["ms"]["wall"]["median"] = ms;
        line["ms"]["wall"]["max"] = 10 * ms;
        line["per_frame"]["wall_ms"] = {ms, ms};
        return line.dump() + "\n";
    };
    const json line = runOf("none", 5, 40), other = runOf("error", 3, 40);
    json later = line;
    later["label"] = "later";
    addRuns(measured(line, 5) + measured(other, 3) + measured(later, 9), "a", runs);
    addRuns(measured(line, 4) + measured(other, 2), "b", runs);
    addRuns(measured(line, 8), "c", runs);
    foldRepeats(runs);
    REQUIRE(runs.rows.size() == 3);
    CHECK(runs.rows[0].ms.wall.median == 5);
    CHECK(runs.rows[0].ms.wall.max == 50); // all of one run
    CHECK(runs.rows[0].rounds == 3);
    CHECK(runs.rows[0].least_ms == 4);
    CHECK(runs.rows[0].most_ms == 8);
    CHECK(runs.rows[1].ms.wall.median == 2.5);
    CHECK(runs.rows[1].ms.wall.max == 30); // the slower of two
    CHECK(runs.rows[1].rounds == 2);
    CHECK(runs.rows[2].label == "later"); // another run
    CHECK(runs.rows[2].rounds == 1);
    CHECK(runs.repeats == 3);
    CHECK(runs.duplicates == 0);
    CHECK(runs.notes.empty());
    RunSet none;
    foldRepeats(none);
    CHECK(none.rows.empty());
}

TEST_CASE("equal images have no error and a run takes time: a line that says otherwise is refused")
{
    for (const char* key : {"pooled", "min"}) {
        CAPTURE(key);
        json line = runOf("error", 2, 40);
        line["accuracy"]["psnr"][key] = nullptr;
        CHECK(refusal(line.dump()) == std::string("runs.jsonl:1: accuracy.psnr.") + key +
                                          " is null, expected a number, or null where max_error is 0; remove the "
                                          "line or run it again");
        line["accuracy"]["max_error"] = 0;
        CHECK(refusal(line.dump()) == "accepted");
        line["accuracy"]["psnr"][key] = "equal";
        CHECK(refusal(line.dump()).find("is \"equal\", expected a number, or null") != std::string::npos);
    }
    json rare = runOf("error", 2, 40); // one image of hundreds
    rare["accuracy"]["psnr"]["p1"] = nullptr;
    CHECK(refusal(rare.dump()) == "accepted");
    CHECK(refusal("\n" + runOf("none", 0, 40).dump()) ==
          "runs.jsonl:2: ms.wall.median is 0.0, expected a number above 0; remove the line or run it again");
}

TEST_CASE("the accuracy of repeats is the worst of all, each score for itself")
{
    const auto measured = [](double ms, const json& psnr, double max_error, const json& temporal) {
        static const json kRun = runOf("error", 1, 40);
        json line = kRun;
        line["ms"]["wall"]["median"] = ms;
        line["per_frame"]["wall_ms"] = {ms, ms};
        line["accuracy"]["psnr"] = {{"pooled", psnr}, {"p1", psnr}, {"min", psnr}, {"min_frame", 0}};
        line["accuracy"]["max_error"] = max_error;
        line["accuracy"]["temporal"] = temporal;
        return line;
    };
    const auto folded = [](const std::vector<json>& lines) {
        RunSet runs;
        for (const json& line : lines)
            addRuns(line.dump(), "a", runs);
        foldRepeats(runs);
        REQUIRE(runs.rows.size() == 1);
        CHECK(runs.repeats == lines.size() - 1);
        return runs.rows[0];
    };
    const auto changes = [](double most) -> json {
        return {{"rms", 0}, {"p50", 0}, {"p99", 0}, {"max", most}, {"max_frame", 1}};
    };
    json first = measured(1, 49, 0.01, changes(0.25)), second = measured(2, nullptr, 0, nullptr),
         third = measured(3, 60, 0.5, changes(0.125));
    first["accuracy"]["psnr"]["pooled"] = 70;
    first["accuracy"]["ssim"] = {{"mean", 0.75}, {"min", 0.5}, {"frames", 2}};
    first["accuracy"]["flip"] = {{"mean", 0.25}, {"max", 0.5}, {"frames", 2}};
    second["accuracy"]["ssim"] = {{"mean", 1}, {"min", 1}, {"frames", 2}};
    second["accuracy"]["flip"] = {{"mean", 0}, {"max", 0}, {"frames", 2}};
    const ChartRun row = folded({third, first, second});
    CHECK(row.ms.wall.median == 2);
    CHECK(row.accuracy->psnr_min == 49);
    CHECK(row.accuracy->psnr_p1 == 49);
    CHECK(row.accuracy->psnr_pooled == 60);
    CHECK(row.accuracy->max_error == 0.5);
    CHECK(row.accuracy->temporal.max == 0.25);
    CHECK(row.accuracy->ssim.mean == 0.75);
    CHECK(row.accuracy->flip.mean == 0.25);
    CHECK(folded({second, measured(4, kBrokenPsnr, 1e30, nullptr), third}).accuracy->psnr_min == kBrokenPsnr);
    CHECK(folded({second, measured(2.5, nullptr, 0, nullptr)}).accuracy->temporal.images == 0);
    // of the same times only what has the same accuracy was told before
    CHECK(folded({measured(1, 60, 0.01, nullptr), measured(1, 49, 0.01, nullptr)}).accuracy->psnr_min == 49);
}

TEST_CASE("the time of an even number of repeats is the mean of the two in the middle")
{
    const json run = runOf("error", 1, 40);
    RunSet runs;
    for (const double ms : {9.0, 2.0, 4.0, 1.0}) {
        json line = run;
        line["ms"]["wall"] = {{"mean", ms}, {"median", ms}, {"p95", 2 * ms}, {"p99", 3 * ms}, {"max", 4 * ms}};
        line["ms"]["device"]["median"] = ms / 2;
        line["ms"]["stages"]["decode"]["median"] = ms / 4;
        line["per_frame"]["wall_ms"] = {ms, ms};
        addRuns(line.dump(), "a", runs);
    }
    foldRepeats(runs);
    REQUIRE(runs.rows.size() == 1);
    const ChartRun& row = runs.rows[0];
    CHECK(row.ms.wall.median == 3);
    CHECK(row.ms.device.median == 1.5);
    CHECK(row.ms.stages[kDecodeStage].median == 0.75);
    CHECK(row.ms.wall.max == 16); // numbers other than medians are from one run
    CHECK(row.wall_ms == std::vector<double>{4, 4});
    CHECK(row.least_ms == 1);
    CHECK(row.most_ms == 9);
    CHECK(row.rounds == 4);
}

TEST_CASE("a file given twice repeats nothing")
{
    RunSet runs;
    const std::string text = runOf("none", 5, 40).dump() + "\n" + runOf("error", 4, 40).dump() + "\n";
    addRuns(text, "a", runs);
    addRuns(text, "a", runs);
    foldRepeats(runs);
    CHECK(runs.rows.size() == 2);
    CHECK(runs.rows[0].rounds == 1);
    CHECK(runs.repeats == 0);
    CHECK(runs.duplicates == 2);
    REQUIRE(runs.notes.size() == 1);
    CHECK(runs.notes[0] == "left out 2 lines told before: the same run with the same times");
}

TEST_CASE("a field that is not known is passed over")
{
    json line = plainRun();
    line["something"] = {1, 2};
    CHECK(parsed(line).rendered_tier == "fast");
}
