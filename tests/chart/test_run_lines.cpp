// SPDX-License-Identifier: Apache-2.0
// Reading runs: what is taken, what is refused and how it is said.
#include "convert/chart/run_set.h"
#include "format/error.h"
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
    const RunRow row = parsed(line);
    CHECK(row.config.policy == "error");
    CHECK(row.config.bound == 0.5);
    CHECK(row.config.width == 640);
    CHECK(row.wall.median == 2.5);
    CHECK(row.wall.p99 == 6);
    CHECK(row.decode_ms == 1.25);
    CHECK(row.accuracy.psnr_min == 41.25);
    CHECK(std::isinf(row.frames.psnr[0]));
    CHECK(row.frames.psnr[1] == 41.25);
    CHECK(std::isnan(row.frames.temporal[0]));
    CHECK(row.frames.decoded == std::vector<double>{10, 10});
    CHECK(std::isinf(parsed(plainRun()).accuracy.psnr_pooled));
    CHECK_FALSE(row.accuracy.ssim_mean);
}

TEST_CASE("blank lines count, other known forms are skipped and told")
{
    RunSet runs;
    const std::string good = plainRun().dump();
    addRuns("\n" + good + "\r\n{\"schema\":\"gsc.bench/1\"}\n  \n{\"schema\":\"gsc.bench/1\"}\n" + good, "a.jsonl",
            runs);
    CHECK(runs.rows.size() == 2);
    CHECK(runs.skipped == 2);
    REQUIRE(runs.notes.size() == 1);
    CHECK(runs.notes[0] == "a.jsonl: skipped 2 lines of gsc.bench/1, which gsc chart does not draw");
}

TEST_CASE("a broken line is refused by file, number and place")
{
    const std::string good = plainRun().dump() + "\n";
    CHECK(refusal(good + good + "{\"schema\": \"gsc.run/1\",").starts_with("runs.jsonl:3: is not JSON"));
    CHECK(refusal("\xff\xfe").starts_with("runs.jsonl:1: is not JSON"));
    CHECK(refusal("[1]").find("expected an object") != std::string::npos);
    CHECK(refusal("{}").starts_with("runs.jsonl:1: has no schema"));
    CHECK(refusal("{\"schema\":\"other/1\"}").find("\"other/1\", expected gsc.run/1") != std::string::npos);
    CHECK(refusal("{\"schema\":\"gsc.run/2\"}", ErrorCode::Unsupported).find("gsc.run/2") != std::string::npos);
}

TEST_CASE("every field the charts need is required and checked")
{
    for (const char* pointer :
         {"/tool", "/label", "/file/path", "/backend", "/device/name", "/config/policy", "/config/tier",
          "/config/frames", "/config/size", "/ms/wall/median", "/ms/stages/decode", "/accuracy/psnr/min",
          "/reuse/hit_rate", "/peak_bytes", "/per_frame/psnr", "/per_frame/decoded"}) {
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
                                                  {"/config/cut", 0},
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
    CHECK(runs.rows[0].wall.median == 5);
    CHECK(runs.rows[0].wall.max == 50); // all of one run
    CHECK(runs.rows[0].repeats == 3);
    CHECK(runs.rows[0].least_ms == 4);
    CHECK(runs.rows[0].most_ms == 8);
    CHECK(runs.rows[1].wall.median == 3); // of two the slower
    CHECK(runs.rows[1].repeats == 2);
    CHECK(runs.rows[2].label == "later"); // another run
    CHECK(runs.rows[2].repeats == 1);
    CHECK(runs.repeats == 3);
    CHECK(runs.duplicates == 0);
    CHECK(runs.notes.empty());
    RunSet none;
    foldRepeats(none);
    CHECK(none.rows.empty());
}

TEST_CASE("a file given twice repeats nothing")
{
    RunSet runs;
    const std::string text = runOf("none", 5, 40).dump() + "\n" + runOf("error", 4, 40).dump() + "\n";
    addRuns(text, "a", runs);
    addRuns(text, "a", runs);
    foldRepeats(runs);
    CHECK(runs.rows.size() == 2);
    CHECK(runs.rows[0].repeats == 1);
    CHECK(runs.repeats == 0);
    CHECK(runs.duplicates == 2);
    REQUIRE(runs.notes.size() == 1);
    CHECK(runs.notes[0] == "left out 2 lines told before: the same run with the same times");
}

TEST_CASE("fields that only newer lines have")
{
    json line = plainRun();
    CHECK(parsed(line).rendered_tier == "fast");
    CHECK(parsed(line).reference.empty());
    line["rendered_tier"] = "exact";
    line["reference"] = "cuda";
    line["something"] = {1, 2};
    CHECK(parsed(line).rendered_tier == "exact");
    CHECK(parsed(line).reference == "cuda");
}
