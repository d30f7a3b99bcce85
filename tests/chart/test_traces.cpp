// SPDX-License-Identifier: Apache-2.0
// Traces of services: what is read, what of it is drawn.
#include "convert/chart/chart_figures.h"
#include "convert/chart/chart_page.h"
#include "convert/chart/trace_model.h"
#include <gsc/error.h>

#include <doctest/doctest.h>

#include <cmath>

using namespace gsc;

namespace {

using Pose = ServiceTraceReport::Pose;

// Two workers; a pose every 10 ms, the i-th of 1000 shown i / 10 ms later; some that were not shown.
ChartTrace longTrace()
{
    ChartTrace trace;
    trace.title = "long";
    trace.tool = {"gsc-play", "0.1.0", ""};
    trace.file = "folder/city.gsc";
    trace.options = {"split", 100, 72, 0, true, {"cuda:0", "cuda:1"}};
    trace.counts = {.submitted = 1003, .shown = 1000, .late = 1, .expired = 1, .failed = 1};
    trace.latency = {50, 95, 99, 100};
    for (uint64_t i = 1; i <= 1000; ++i) {
        const double submitted = 0.01 * double(i), ms = 0.1 * double(i);
        trace.poses.push_back({.id = i,
                               .submitted = submitted,
                               .ended = submitted + 1e-3 * ms,
                               .begun = submitted,
                               .end = "shown",
                               .latency_ms = ms,
                               .worker = int64_t(i % 2)});
    }
    for (const char* end : {"late", "expired", "failed"})
        trace.poses.push_back({.id = 1000, .submitted = 10, .ended = 10.5, .end = end});
    for (uint64_t i = 0; i < 2; ++i)
        trace.workers.push_back({.index = i,
                                 .device = "cuda:" + std::to_string(i),
                                 .name = "GPU",
                                 .state = "working",
                                 .frames = 500,
                                 .parts = 1000,
                                 .busy_ms = 3000,
                                 .stage_ms = {100, 200, 300, 400, 500, 600},
                                 .last_fault = {}});
    trace.rate = {{5, 100, 2}, {10.5, 90, 1}};
    trace.events = {{0, "start", 0, "from the start", 0, 0},   {0.5, "ready", 0, "loaded", 0, 1},
                    {1, "plan", -1, "tries all", 100, 1},      {2, "retire", 1, "illegal address </script><b>", 100, 1},
                    {3, "return", 1, "after a fault", 100, 1}, {4, "stop", 0, "fast enough", 100, 1}};
    return trace;
}

ChartTrace emptyTrace()
{
    ChartTrace trace;
    trace.title = "empty";
    trace.tool = {"gsc-play", "0.1.0", ""};
    trace.options.mode = "frame";
    return trace;
}

std::string lineOf(ServiceTraceReport trace)
{
    return toJson(std::move(trace)).dump();
}

} // namespace

TEST_CASE("traces: one a line, or one over many lines")
{
    const std::string line = lineOf(longTrace());
    CHECK(isTraceText(line));
    CHECK(isTraceText("\n {\"schema\" : \"gsc.service-trace/7\"}"));
    for (const char* other : {"", "{}", "{\"schema\":\"gsc.run/1\"}", "{\"a\":1,\"schema\":\"gsc.service-trace/1\"}",
                              "{\"schema\":", "gsc.service-trace/1"})
        CHECK_FALSE(isTraceText(other));

    std::vector<ChartTrace> traces;
    addTraces(line + "\n\n" + lineOf(emptyTrace()) + "\n", "a/two.jsonl", traces);
    REQUIRE(traces.size() == 2);
    CHECK(traces[0].title == "two 1");
    CHECK(traces[1].title == "two 2");
    CHECK(traces[0].poses.size() == 1003);
    addTraces(OrderedJson::parse(line).dump(2), "one.json", traces);
    REQUIRE(traces.size() == 3);
    CHECK(traces[2].title == "one");
    CHECK(lineOf(traces[2]) == line);
}

TEST_CASE("traces: what is no trace is refused with its line")
{
    std::vector<ChartTrace> traces;
    const auto refuses = [&](const std::string& text, const std::string& words) {
        try {
            addTraces(text, "a.jsonl", traces);
            FAIL("taken");
        } catch (const Error& error) {
            CHECK(error.code() == ErrorCode::InvalidFile);
            const std::string message = error.what();
            CAPTURE(message);
            CHECK(message.find(words) != message.npos);
        }
    };
    const std::string line = lineOf(emptyTrace());
    refuses(line + "\n" + line.substr(0, 40) + "}\n", "a.jsonl:2: is not JSON");
    refuses(line.substr(0, 100), "a.jsonl: is not JSON"); // its first line has no end
    std::string keys = "{\"schema\":\"gsc.service-trace/1\"";
    for (int i = 0; i < 200; ++i)
        keys += ",\"k" + std::to_string(i) + "\":1";
    refuses(keys + "," + line.substr(1) + "\n",
            "a.jsonl:1: has an object of more than 100 keys, expected one trace per line");
    refuses("{\"schema\":\"gsc.service-trace/1\",\"tool\":" + std::string(50, '[') + std::string(50, ']') + "}",
            "a.jsonl:1: nests deeper than 16 levels");
}

TEST_CASE("the model of a trace: distribution, shares, times")
{
    const auto model = traceModel({longTrace(), emptyTrace(), longTrace()});
    CHECK(kindOf(model) == PageKind::Service);
    REQUIRE(model["panels"].size() == 3);
    CHECK(model["panels"][2]["file_name"] == "long-2");
    const auto& panel = model["panels"][0];
    CHECK(panel["end"] == 10.5);
    CHECK(panel["min_fps"] == 72);
    CHECK(panel["max_fps"].is_null());
    CHECK(panel["words"] ==
          "city.gsc, mode split, 100 poses a second, at least 72 fps, all poses kept; devices cuda:0, "
          "cuda:1");
    CHECK(panel["verdict"] ==
          "1,000 of 1,003 poses shown in 10.5 s, 95.24 a second, 1 late, 1 expired, 1 failed. Latency "
          "50 ms in the median, 99 ms at p99, 100 ms at most.");
    for (const char* end : {"late", "expired", "failed"})
        CHECK(panel["poses"][end].size() == 1);
    CHECK(panel["poses"]["shown"].size() == 1000);

    const auto& distribution = panel["distribution"];
    CHECK(distribution["step"] == 5); // 100 ms in at most 40 steps
    uint64_t sum = distribution["over"];
    for (const auto& count : distribution["counts"])
        sum += count.get<uint64_t>();
    CHECK(sum == 1000);
    CHECK(distribution["counts"][1] == 50);
    CHECK(distribution["cdf"].back()[1] == 100);
    CHECK(distribution["cdf"].back()[0] == 100);
    for (const auto& point : distribution["cdf"]) // equally many poses at each latency
        CHECK(point[0].get<double>() == doctest::Approx(point[1].get<double>()).epsilon(0.01));

    const auto& worker = panel["workers"][1];
    CHECK(worker["busy_s"] == 3);
    CHECK(worker["busy_share"].get<double>() == doctest::Approx(3 / 10.5).epsilon(1e-4));
    CHECK(worker["untold_s"] == 0.9);
    CHECK(worker["stage_s"][5] == 0.6);
    CHECK(worker["spans"].empty()); // never ready
    CHECK(panel["workers"][0]["spans"].dump() == "[[0.5,4]]");

    const auto& nothing = model["panels"][1];
    CHECK(nothing["distribution"].is_null());
    CHECK(nothing["workers"].empty());
    CHECK(nothing["verdict"] == "0 of 0 poses shown.");
}

TEST_CASE("a worker's bars end where it stops, fails or the run is over")
{
    ChartTrace trace = longTrace();
    trace.events = {{0, "start", 0, "", 0, 0}, {0, "ready", 1, "", 0, 0},        {1, "ready", 0, "", 0, 1},
                    {2, "start", 1, "", 0, 2}, {3, "stop", 1, "", 0, 1},         {4, "start", 1, "", 0, 2},
                    {5, "start", 1, "", 0, 2}, {6, "retire", 0, "broken", 0, 1}, {7, "return", 0, "", 0, 1},
                    {8, "ready", 0, "", 0, 2}, {9, "stop", 7, "", 0, 2}};
    const auto workers = traceModel({trace})["panels"][0]["workers"];
    CHECK(workers[0]["spans"].dump() == "[[1,6],[8,10.5]]");
    CHECK(workers[1]["spans"].dump() == "[[2,3],[4,10.5]]");
}

TEST_CASE("poses are thinned, and far latencies counted apart")
{
    ChartTrace trace = emptyTrace();
    for (uint64_t i = 0; i < 3 * kMostTracePoses; ++i) {
        const double ms = i < 5 ? 1e4 : 1;
        trace.poses.push_back({.id = i, .ended = 1, .end = "shown", .latency_ms = ms});
    }
    const auto panel = traceModel({trace})["panels"][0];
    CHECK(panel["poses"]["shown"].size() == kMostTracePoses);
    CHECK(panel["distribution"]["over"] == 5);
    CHECK(panel["distribution"]["counts"].size() <= 40);
}

TEST_CASE("the page of traces holds the model unharmed, and asks for nothing from elsewhere")
{
    const auto model = traceModel({longTrace()});
    const std::string page = chartPage(model);
    CHECK(page.find("<title>Renderer service</title>") != page.npos);
    CHECK(page.find("default-src 'none'") != page.npos);
    CHECK(page.find("</script><b>") == page.npos);
    for (const char* mark : {"@STYLE@", "@MODEL@", "@ECHARTS@", "@PARTS@", "@FIGURES@", "@REPORT@"})
        CHECK(page.find(mark) == page.npos);
    const size_t begin = page.find("id=\"model\">") + 11;
    CHECK(nlohmann::ordered_json::parse(page.substr(begin, page.find("</script>", begin) - begin)) == model);
    CHECK(page == chartPage(traceModel({longTrace()})));
}

TEST_CASE("figures of traces, of one that did nothing too")
{
    if (!hasFigures())
        return;
    ChartTrace one = emptyTrace(), waiting = emptyTrace();
    one.title = "one";
    one.poses = {{.id = 1, .ended = 0, .end = "shown", .latency_ms = 0}};
    waiting.title = "waiting";
    waiting.poses = {{.id = 1, .ended = 3, .end = "expired"}};
    waiting.workers = {{.index = 0, .state = "gone", .last_fault = "broken"}};
    const auto files = drawFigures(traceModel({longTrace(), emptyTrace(), one, waiting}), [](size_t, size_t) {});
    REQUIRE(files.size() == 4 * 6);
    CHECK(files[1].name == "long-over-time.svg");
    for (const FigureFile& file : files) {
        CAPTURE(file.name);
        if (file.name.ends_with(".png")) {
            CHECK(file.bytes.starts_with("\x89PNG"));
            continue;
        }
        CHECK(file.bytes.starts_with("<svg "));
        for (const char* wrong : {"NaN", "Infinity", "undefined", "<script", "dominant-baseline"})
            CHECK_MESSAGE(file.bytes.find(wrong) == file.bytes.npos, wrong);
    }
    for (const char* words : {">retired after a fault<", ">limits of the rate<", ">another plan<", ">expired<",
                              ">workers, while they draw<", ">cuda:1<"})
        CHECK_MESSAGE(files[1].bytes.find(words) != std::string::npos, words);
    CHECK(files[3].bytes.find(">p95 95.0<") != std::string::npos);
    CHECK(files[5].bytes.find(">1,000 parts, 3.00 ms each<") != std::string::npos);
}
