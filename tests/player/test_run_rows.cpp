// SPDX-License-Identifier: Apache-2.0
// The file of a sweep that was stopped, the id of a run, and bounds of stability.
#include "player/sweep/run_rows.h"

#include <gsc/error.h>
#include "player/measure/run_facts.h"
#include "player/measure/run_text.h"
#include "player/measure/stability.h"

#include <doctest/doctest.h>
#include <nlohmann/json.hpp>

#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>
#include <string>

#include <unistd.h>

using namespace gsc;

namespace {

// A file that goes away with the object.
class TempFile {
public:
    explicit TempFile(const std::string& content)
        : m_path((std::filesystem::temp_directory_path() / ("gsc_rows_" + std::to_string(getpid()))).string())
    {
        std::ofstream(m_path, std::ios::binary) << content;
    }
    ~TempFile() { (void)std::remove(m_path.c_str()); }
    TempFile(const TempFile&) = delete;
    TempFile& operator=(const TempFile&) = delete;

    [[nodiscard]] const std::string& path() const { return m_path; }
    [[nodiscard]] std::string content() const
    {
        std::ifstream stream(m_path, std::ios::binary);
        std::ostringstream text;
        text << stream.rdbuf();
        return text.str();
    }

private:
    std::string m_path;
};

Path onePath()
{
    Path path;
    path.name = "walk";
    path.cameras = "paths/walk.json";
    Shot shot;
    shot.camera.rotation[0] = shot.camera.rotation[4] = shot.camera.rotation[8] = 1;
    shot.camera.fov_x = shot.camera.fov_y = 1;
    shot.camera.width = shot.camera.height = 8;
    path.shots = {shot, shot, shot};
    return path;
}

RunResult someResult()
{
    RunResult result;
    result.frames.resize(3);
    for (size_t i = 0; i < 3; ++i) {
        TimedFrame& frame = result.frames[i];
        frame.wall_ms = double(i + 1);
        frame.result.eyes[0].anchors_decoded = 100 - 40 * i; // 100, 60, 20
        frame.result.eyes[0].anchors_reused = 40 * i;        // 0, 40, 80
        frame.result.eyes[0].anchors_visible = 80;
        frame.result.eyes[0].groups_tested = 5;
        frame.result.eyes[0].anchors_overdue = i;
        frame.result.cache_bytes = 1000 * i;
        frame.result.cache_evictions = i;
        frame.result.repeats = 4 >> i; // 4, 2, 1
    }
    result.accuracy.images = 3;
    result.accuracy.psnr_min = 55;
    result.accuracy.frame_psnr = {std::numeric_limits<double>::infinity(), 55, 60};
    result.accuracy.frame_temporal = {std::numeric_limits<double>::quiet_NaN(), 0.5, 0.25};
    result.accuracy.temporal = {2, 0.4, 0.25, 0.5, 0.5, 0.5, 1};
    return result;
}

RunContext someContext()
{
    RunContext context;
    context.file = {"m.gsc", 1, 1};
    context.file_hash = 77;
    context.warmup = 1;
    context.reference = "cpu";
    return context;
}

RunRow someRow(const RunConfig& run, const RunResult& result = someResult())
{
    const RunContext context = someContext();
    return runRow(context, rowConfig(context, onePath(), run), run.backend, result);
}

std::string lineOf(const RunRow& row)
{
    return jsonText(toJson(row), -1);
}

RunConfig errorRun(float bound)
{
    RunConfig run;
    run.backend = "cpu";
    run.reuse.policy = ReusePolicy::Error;
    run.reuse.bound = bound;
    return run;
}

std::string idOf(const RunContext& context, const Path& path, const RunConfig& run)
{
    return rowConfig(context, path, run).id;
}

ErrorCode openError(const std::string& path)
{
    try {
        const RunRows rows(path, false);
    } catch (const Error& e) {
        return e.code();
    }
    return ErrorCode::Ok;
}

} // namespace

TEST_CASE("the numbers of a row")
{
    const OrderedJson row = toJson(someRow(errorRun(1)));
    CHECK(row["ms"]["wall"]["mean"] == 2.5); // without the first frame
    CHECK(row["repeats"] == 3);              // without it too
    CHECK(row["per_frame"]["wall_ms"] == OrderedJson{1.0, 2.0, 3.0});
    CHECK(row["reuse"]["decoded_per_frame"]["mean"] == 60); // with it
    CHECK(row["reuse"]["hit_rate"] == 0.5);                 // 120 / 240
    CHECK(row["reuse"]["overdue"] == 3);
    CHECK(row["reuse"]["evictions"] == 3);
    CHECK(row["reuse"]["cache_bytes"] == 2000);
    CHECK(row["per_frame"]["psnr"] == OrderedJson{nullptr, 55.0, 60.0});
    CHECK(row["per_frame"]["temporal"] == OrderedJson{nullptr, 0.5, 0.25});
    CHECK(row["per_frame"]["decoded"] == OrderedJson{100, 60, 20});
    const std::string line = runTableLine(someRow(errorRun(1)));
    for (const char* word : {"walk", "cpu", "error 1 ", "55.00", "50.0"})
        CHECK(line.find(word) != std::string::npos);
    // more warm-up than frames leaves the last
    CHECK(timesOf(timedFrames(someResult().frames, 9)).wall.mean == 3);
}

TEST_CASE("a line tells a bound of 0, and none where there is none")
{
    RunConfig run = errorRun(0);
    CHECK(runTableLine(someRow(run)).find("error 0 ") != std::string::npos);
    run.reuse.policy = ReusePolicy::Depth;
    run.reuse.max_depth = 0;
    CHECK(runTableLine(someRow(run)).find("depth 0 lin") != std::string::npos);
    run.reuse.policy = ReusePolicy::None;
    CHECK(runTableLine(someRow(run)).find("none  ") != std::string::npos);
}

TEST_CASE("a run that saw nothing has hit nothing")
{
    RunResult nothing = someResult();
    for (TimedFrame& frame : nothing.frames)
        frame.result.eyes[0] = {};
    const OrderedJson row = toJson(someRow(errorRun(1), nothing));
    CHECK(row["reuse"]["hit_rate"] == 0);
    CHECK(row["reuse"]["decoded_per_frame"]["mean"] == 0);
}

TEST_CASE("an id is of everything that changes a result and of nothing else")
{
    const RunContext context = someContext();
    const Path path = onePath();
    const std::string id = idOf(context, path, errorRun(1));
    CHECK(id.size() == 16);
    CHECK(idOf(context, path, errorRun(1)) == id);
    CHECK(idOf(context, path, errorRun(2)) != id);
    Path moved = path;
    moved.shots[2].camera.translation[1] = 1e-3;
    CHECK(idOf(context, moved, errorRun(1)) != id);
    Path renamed = path;
    renamed.cameras = "elsewhere/walk.json";
    CHECK(idOf(context, renamed, errorRun(1)) == id);
    RunContext labelled = context;
    labelled.label = "again";
    labelled.file.path = "other/m.gsc";
    CHECK(idOf(labelled, path, errorRun(1)) == id);
    RunContext other = context;
    other.file_hash = 78;
    CHECK(idOf(other, path, errorRun(1)) != id);
    other = context;
    other.devices.vram_budget = 1;
    CHECK(idOf(other, path, errorRun(1)) != id);
    other = context;
    other.devices.workers.devices = {{"cpu", 0}, {"cpu", 0}};
    CHECK(idOf(other, path, errorRun(1)) != id);
    RunConfig nearer = errorRun(1);
    nearer.near_z = 0.5;
    CHECK(idOf(context, path, nearer) != id);
    other = context;
    other.reference = "cpu-reference";
    CHECK(idOf(other, path, errorRun(1)) != id);
}

TEST_CASE("foveation makes another run, which is found again with what lies where")
{
    RunConfig plain = errorRun(1), thin = plain;
    thin.foveation = FoveationMode::Fixed;
    thin.fovea_pixels = 1.5;
    RunConfig off = thin;
    off.foveation = FoveationMode::None;
    const std::string id = idOf(someContext(), onePath(), plain);
    CHECK(idOf(someContext(), onePath(), thin) != id);
    CHECK(idOf(someContext(), onePath(), off) == id);

    RunResult result = someResult();
    result.accuracy.fovea = FoveaAccuracy{{0.25, 80, 79, 1, -1}, {0.75, 40, 38, 2, 0.5}};
    const RunRow row = someRow(thin, result);
    const OrderedJson json = toJson(row);
    CHECK(json["config"]["fovea_pixels"] == 1.5);
    CHECK(json["accuracy"]["fovea"]["outside"]["psnr"] ==
          OrderedJson{{"pooled", 40.0}, {"min", 38.0}, {"min_frame", 2}});
    CHECK(json["accuracy"]["fovea"]["inside"]["flip_mean"].is_null());
    const std::string line = runTableLine(row);
    CHECK(line.find(" fovea 1.5 ") != std::string::npos);
    CHECK(line.find("\n    within 12 degrees of the gaze: PSNR 80.00 dB pooled") != std::string::npos);

    const TempFile file(lineOf(someRow(plain)) + "\n" + lineOf(row) + "\n");
    const RunRows rows(file.path(), false);
    REQUIRE(rows.find(row.config.id) != nullptr);
    CHECK(lineOf(*rows.find(row.config.id)) == lineOf(row));
    CHECK(toJson(*rows.find(id))["config"]["fovea_pixels"].is_null());
    CHECK_FALSE(toJson(*rows.find(id))["accuracy"].contains("fovea"));
}

TEST_CASE("detail makes another run, which is found again")
{
    RunConfig plain, coarse;
    plain.backend = coarse.backend = "cpu";
    coarse.detail = 1.5;
    const std::string id = idOf(someContext(), onePath(), plain);
    CHECK(idOf(someContext(), onePath(), coarse) != id);
    const RunRow row = someRow(coarse);
    CHECK(toJson(row)["config"]["detail"] == 1.5);
    CHECK(toJson(row)["config"]["tier"] == "fast");
    CHECK(toJson(someRow(plain))["config"]["detail"] == 0);
    CHECK(runTableLine(row).find("none detail 1.5 ") != std::string::npos);

    const TempFile file(lineOf(row) + "\n");
    const RunRows rows(file.path(), false);
    REQUIRE(rows.find(row.config.id) != nullptr);
    CHECK(lineOf(*rows.find(row.config.id)) == lineOf(row));
}

TEST_CASE("rows are found again, a half-written one is cut off when the next comes")
{
    const RunRow first = someRow(errorRun(1)), second = someRow(errorRun(2));
    const std::string whole = lineOf(first) + "\n";
    for (const size_t left : {size_t(2), size_t(10), size_t(300), lineOf(second).size() - 1}) {
        const TempFile file(whole + lineOf(second).substr(0, left));
        RunRows rows(file.path(), false);
        CHECK(rows.cutOff().find("line 2 is half-written") != std::string::npos);
        REQUIRE(rows.find(first.config.id) != nullptr);
        CHECK(lineOf(*rows.find(first.config.id)) == lineOf(first));
        CHECK(rows.find(second.config.id) == nullptr);
        CHECK(file.content().size() == whole.size() + left); // nothing is lost before there is more
        rows.append(second);
        CHECK(file.content() == whole + lineOf(second) + "\n");
        CHECK(rows.find(second.config.id) != nullptr);
    }
}

TEST_CASE("a whole last row that lacks its end alone is kept")
{
    const RunRow first = someRow(errorRun(1)), second = someRow(errorRun(2)), third = someRow(errorRun(3));
    for (const std::string& before : {std::string(), lineOf(first) + "\n"}) {
        const TempFile file(before + lineOf(second));
        RunRows rows(file.path(), false);
        CHECK(rows.cutOff().empty());
        CHECK(rows.find(second.config.id) != nullptr);
        rows.append(third);
        CHECK(file.content() == before + lineOf(second) + "\n" + lineOf(third) + "\n");
        rows.append(first); // its own end is no surprise
        CHECK(file.content() == before + lineOf(second) + "\n" + lineOf(third) + "\n" + lineOf(first) + "\n");
    }
}

TEST_CASE("whole, empty and missing files say nothing")
{
    const TempFile whole(lineOf(someRow(errorRun(1))) + "\n");
    CHECK(RunRows(whole.path(), false).find("0") == nullptr);
    CHECK(RunRows(whole.path(), false).cutOff().empty());
    CHECK(openError(whole.path() + "none") == ErrorCode::Ok);
    CHECK(openError("") == ErrorCode::Ok);
    const TempFile empty("");
    CHECK(openError(empty.path()) == ErrorCode::Ok);
}

TEST_CASE("two sweeps on one file do not lose each other's rows: the second to write is told")
{
    const TempFile file(lineOf(someRow(errorRun(1))) + "\n");
    RunRows first(file.path(), false), second(file.path(), false);
    first.append(someRow(errorRun(2)));
    first.append(someRow(errorRun(3))); // its own lines are no surprise
    CHECK_THROWS_AS(second.append(someRow(errorRun(4))), Error);
    const RunRows whole(file.path(), false);
    CHECK(whole.cutOff().empty());
    for (const float bound : {1.0f, 2.0f, 3.0f})
        CHECK(whole.find(idOf(someContext(), onePath(), errorRun(bound))) != nullptr);
}

TEST_CASE("a file of something else is left alone")
{
    OrderedJson bare = toJson(someRow(errorRun(1)));
    bare["per_frame"].erase("decoded");
    OrderedJson no_time = toJson(someRow(errorRun(1)));
    no_time.erase("ms");
    for (const std::string& content :
         {std::string("precious notes"), std::string("precious\n"), std::string(R"({"schema":"gsc.play/1"})") + "\n",
          std::string(R"({"schema":"gsc.play)"), std::string("\n"), std::string("{"), jsonText(bare, -1),
          jsonText(bare, -1) + "\n", jsonText(no_time, -1) + "\n", std::string(R"({"schema":"gsc.run/2"})") + "\n"}) {
        CAPTURE(content);
        const TempFile file(content);
        CHECK(openError(file.path()) == ErrorCode::InvalidFile);
        CHECK(file.content() == content);
    }
}

TEST_CASE("rows of an earlier version are refused with the command that makes new ones")
{
    for (const char* kind : {"run", "bench", "stability"}) {
        const std::string content = std::string(R"({"schema":"gsc.)") + kind + R"(/1"})" + "\n";
        const TempFile file(content);
        CHECK(openError(file.path()) == ErrorCode::Unsupported);
        CHECK(file.content() == content);
    }
}

TEST_CASE("every part of a row is read as it is written")
{
    RunRow row = someRow(errorRun(1));
    row.open_ms = 1.5;
    row.work.emplace();
    row.work->per_eye[0] = {1, 2, 3, 4, 5};
    row.work->coarse[3] = {5, 4, 3, 2, 1};
    row.work->target = TargetFacts{{-0.5, -1, 0}, {2, 1, 4}};
    row.work->roofline = RooflineFacts{
        {1, 2, 3, 4, 5}, {{"blend", 1, 2, 3, 4, 5, 6, 7, 8, "memory"}, {"frame", 0, 0, 0, 0, 0, 0, 0, 0, ""}}};
    row.stability =
        StabilityFacts{{{"psnr", 50, std::numeric_limits<double>::infinity(), 0, true}, {"p99", 2, 3, 1, false}}};
    row.curve = CurveFacts{40, 10, 20, 30, "a.png", {4, 3, 2, 1}};
    row.service =
        ServiceFacts{"eye", 2, "", ServiceFacts::Wire{5, 4}, {{"cuda:1", "H200", "warm", 3, 1.5, 2, 1, 0, 1, "x"}}};
    row.warnings = {"beware"};
    row.shard = ShardFacts{1, 2, 0, 2, "00", "11"};
    const std::string line = lineOf(row);
    RunRow back;
    describe(Record(OrderedJson::parse(line), "rows.jsonl:1"), back);
    CHECK(lineOf(back) == line);
    CHECK_FALSE(back.stability->passed());
    CHECK(back.work->roofline->stages[0].bound == "memory");
    CHECK(back.service->list[0].last_fault == "x");
}

TEST_CASE("a verdict on a broken picture is not read back as one on equal pictures")
{
    for (const double broken : {-std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()}) {
        RunRow row = someRow(errorRun(1));
        row.stability = StabilityFacts{{{"psnr", 50, broken, 0, false}, {"temporal", 2, broken, 0, false}}};
        RunRow back;
        describe(Record(OrderedJson::parse(lineOf(row)), "rows.jsonl:1"), back);
        CHECK(back.stability->verdicts[0].value == kBrokenPsnr);
        CHECK(back.stability->verdicts[1].value == kWorstError);
    }
}

TEST_CASE("bounds of stability")
{
    StabilityOptions options;
    options.warmup = 0;
    options.bound_p99 = 1.5;
    const RunResult run = someResult(); // 55 dB, temporal 0.5 against a median of 0.25, 3 ms against 2
    std::vector<Verdict> verdicts = judge(options, run);
    REQUIRE(verdicts.size() == 3);
    CHECK(verdicts[0].value == 55);
    CHECK(verdicts[1].value == 2);
    CHECK(verdicts[1].frame == 1);
    CHECK(verdicts[2].value == 1.5);
    CHECK(verdicts[2].frame == 2);
    for (const Verdict& verdict : verdicts)
        CHECK(verdict.passed); // each on its bound
    options.bound_psnr = 55.1;
    options.bound_temporal = 1.9;
    options.bound_p99 = 1.4;
    for (const Verdict& verdict : judge(options, run))
        CHECK_FALSE(verdict.passed);
    options.bound_psnr = options.bound_temporal = options.bound_p99 = 0;
    CHECK(judge(options, run).empty());
}

TEST_CASE("what nobody can see is no flicker, and a run that is not finite passes nothing")
{
    StabilityOptions options;
    RunResult run = someResult();
    run.accuracy.temporal = {2, 1e-7, 0, 1e-6, 1e-6, 1e-6, 1};
    CHECK(judge(options, run)[1].passed);
    run.accuracy.temporal.max = 1e-3;
    CHECK_FALSE(judge(options, run)[1].passed);
    run.accuracy.psnr_min = std::numeric_limits<double>::infinity();
    CHECK(judge(options, run)[0].passed);
    run.accuracy.psnr_min = -std::numeric_limits<double>::infinity();
    CHECK_FALSE(judge(options, run)[0].passed);
    run.accuracy.psnr_min = std::numeric_limits<double>::quiet_NaN();
    CHECK_FALSE(judge(options, run)[0].passed);
}
