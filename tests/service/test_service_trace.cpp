// SPDX-License-Identifier: Apache-2.0
// A service's trace as a report, and the report as JSON and back.
#include "player/devices/make_service_trace.h"

#include <doctest/doctest.h>

#include <functional>

using namespace gsc;
using namespace std::chrono_literals;

namespace {

using Kind = TraceEvent::Kind;

ServiceTrace smallTrace()
{
    ServiceTrace trace;
    trace.events = {{0ms, Kind::Start, 0, "from the start"}, {1ms, Kind::Start, 1, "from the start"},
                    {200ms, Kind::Ready, 0, "loaded"},       {300ms, Kind::Ready, 1, "loaded"},
                    {600ms, Kind::Retire, 1, "it broke"},    {700ms, Kind::Return, 1, "after a fault"},
                    {800ms, Kind::Ready, 1, "loaded"},       {900ms, Kind::Stop, 0, "fast enough"},
                    {950ms, Kind::Plan, -1, "tries all"}};
    StageTimes stages;
    stages.decode = 2;
    stages.blend = 3;
    for (uint64_t i = 1; i <= 10; ++i) {
        TracePose pose;
        pose.pose = i;
        pose.submitted = i * 100ms - 20ms;
        pose.ended = i * 100ms;
        pose.begun = i * 100ms - 10ms;
        pose.worker = int(i % 2);
        pose.stages = stages;
        trace.poses.push_back(pose);
    }
    trace.poses[3].end = PoseEnd::Late;
    trace.poses[4].end = PoseEnd::Expired;
    trace.poses[4].worker = -1;
    trace.poses[4].begun.reset();
    trace.left_out = 7;
    return trace;
}

ServiceStats smallStats()
{
    ServiceStats stats;
    stats.counts.submitted = 10;
    stats.counts.ended[uint32_t(PoseEnd::Shown)] = 8;
    stats.counts.ended[uint32_t(PoseEnd::Late)] = stats.counts.ended[uint32_t(PoseEnd::Expired)] = 1;
    stats.still = 3;
    stats.latency = {20, 21, 22, 23};
    stats.workers.resize(2);
    stats.workers[0].device = {"cuda", 0};
    stats.workers[0].state = WorkerState::Warm;
    stats.workers[1].device = {"cuda", 1};
    stats.workers[1].state = WorkerState::Working;
    stats.workers[1].faults = 1;
    stats.workers[1].last_fault = "it broke";
    stats.workers[1].busy_ms = 40;
    return stats;
}

ServiceTraceReport smallReport()
{
    ServiceTraceReport report = makeServiceTrace(smallTrace(), smallStats());
    report.tool = thisTool();
    report.file = "city.gsc";
    report.options = {"frame", 10, 5, 0, true, {"cuda:0", "cuda:1"}};
    return report;
}

Error errorOf(const OrderedJson& json)
{
    try {
        (void)parseServiceTrace(json, "a.jsonl:1");
    } catch (const Error& error) {
        return error;
    }
    return Error(ErrorCode::Ok, "trace", "no error", "one", "mend the test");
}

} // namespace

TEST_CASE("a service's trace: rates, workers that draw and sums are counted from events and poses")
{
    const ServiceTraceReport report = smallReport();
    CHECK(report.counts.submitted == 10);
    CHECK(report.counts.shown == 8);
    CHECK(report.counts.late == 1);
    CHECK(report.counts.expired == 1);
    CHECK(report.counts.still == 3);
    CHECK(report.counts.left_out == 7);

    REQUIRE(report.rate.size() == 10); // samples of 0.1 s
    const uint64_t drawing[] = {0, 1, 2, 2, 2, 1, 1, 2, 1, 1};
    for (size_t i = 0; i < 10; ++i) {
        CAPTURE(i);
        CHECK(report.rate[i].time == doctest::Approx(0.1 * double(i + 1)));
        CHECK(report.rate[i].workers == drawing[i]);
    }
    double shown = 0;
    for (const ServiceTraceReport::Sample& sample : report.rate)
        shown += 0.1 * sample.fps;
    CHECK(shown == doctest::Approx(8));

    REQUIRE(report.events.size() == 9);
    CHECK(report.events[4].kind == "retire");
    CHECK(report.events[4].workers == 1);
    CHECK(report.events[6].workers == 2);
    CHECK(report.events[8].worker == -1);
    CHECK(report.events[8].rate == doctest::Approx(7 / 0.95));

    CHECK(report.poses[0].latency_ms == doctest::Approx(20));
    CHECK(report.poses[3].latency_ms == -1);
    CHECK(report.poses[4].begun == -1);
    CHECK(report.workers[0].frames == 5);
    CHECK(report.workers[1].frames == 4);
    CHECK(report.workers[1].stage_ms[1] == doctest::Approx(8)); // decode
    CHECK(report.workers[1].stage_ms[5] == doctest::Approx(12));
    CHECK(report.workers[1].device == "cuda:1");
}

TEST_CASE("a service that did nothing has a trace of nothing")
{
    const ServiceTraceReport report = makeServiceTrace({}, {});
    CHECK(report.rate.empty());
    CHECK(report.poses.empty());
    CHECK(report.workers.empty());
}

TEST_CASE("a service's trace is read back as it was written")
{
    const OrderedJson json = toJson(smallReport());
    CHECK(json["schema"] == kServiceTraceSchema);
    CHECK(json["options"]["max_fps"].is_null());
    CHECK(json["poses"][4]["worker"].is_null());
    CHECK(json["workers"][0]["last_fault"].is_null());
    const OrderedJson again = toJson(parseServiceTrace(OrderedJson::parse(json.dump()), "a.jsonl:1"));
    CHECK(again == json);
}

TEST_CASE("a service's trace with a field that is missing or wrong is refused, and the field named")
{
    const OrderedJson good = OrderedJson::parse(toJson(smallReport()).dump()); // as it comes from a file
    CHECK(errorOf(good).code() == ErrorCode::Ok);
    const auto refuses = [&](const std::function<void(OrderedJson&)>& change, ErrorCode code, const char* words) {
        OrderedJson json = good;
        change(json);
        const Error error = errorOf(json);
        CAPTURE(std::string(error.what()));
        CHECK(error.code() == code);
        CHECK(std::string(error.what()).find(words) != std::string::npos);
    };
    constexpr ErrorCode kInvalid = ErrorCode::InvalidFile;
    refuses([](OrderedJson& j) { j["schema"] = "gsc.service-trace/2"; }, ErrorCode::Unsupported,
            "expected gsc.service-trace/1");
    refuses([](OrderedJson& j) { j["counts"].erase("late"); }, kInvalid,
            "a.jsonl:1: has no counts.late, expected a whole line of gsc.service-trace/1");
    refuses([](OrderedJson& j) { j["poses"][2]["end"] = "lost"; }, kInvalid,
            "a.jsonl:1, poses[2]: end is \"lost\", expected shown, late, expired or failed");
    refuses([](OrderedJson& j) { j["poses"][2]["latency_ms"] = nullptr; }, kInvalid,
            "a number of a pose that is shown");
    refuses([](OrderedJson& j) { j["events"][0]["kind"] = 3; }, kInvalid, "events[0]: kind is 3");
    refuses([](OrderedJson& j) { j["workers"][1]["state"] = "busy"; }, kInvalid, "workers[1]: state is");
    refuses([](OrderedJson& j) { j["workers"][1]["stage_ms"]["sort"] = -1; }, kInvalid, "stage_ms.sort is -1");
    refuses([](OrderedJson& j) { j["rate"] = 5; }, kInvalid, "rate is 5, expected an array");
    refuses([](OrderedJson& j) { j["rate"][1] = 5; }, kInvalid, "rate[1]");
    refuses([](OrderedJson& j) { j["options"]["mode"] = "both"; }, kInvalid, "auto, frame, eye or split");
    refuses([](OrderedJson& j) { j["options"]["devices"] = {1}; }, kInvalid, "an array of texts");
}
