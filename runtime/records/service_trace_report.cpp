// SPDX-License-Identifier: Apache-2.0
#include "runtime/records/service_trace_report.h"

#include <gsc/error.h>

#include <algorithm>
#include <initializer_list>
#include <string_view>

namespace gsc {

namespace {

using Trace = ServiceTraceReport;

bool isOneOf(const OrderedJson& value, std::initializer_list<std::string_view> words)
{
    return value.is_string() && std::ranges::find(words, value.get_ref<const std::string&>()) != words.end();
}

const FieldKind kServiceModeField = {[](const OrderedJson& v) {
                                         return isOneOf(v, {"auto", "frame", "eye", "split"});
                                     },
                                     "auto, frame, eye or split"};
const FieldKind kShareField = {[](const OrderedJson& v) {
                                   return isOneOf(v, {"frame", "eye", "split"});
                               },
                               "frame, eye, split or null"};
const FieldKind kWorkerStateField = {[](const OrderedJson& v) {
                                         return isOneOf(v, {"cold", "loading", "warm", "working", "retired", "gone"});
                                     },
                                     "cold, loading, warm, working, retired or gone"};
const FieldKind kEventField = {[](const OrderedJson& v) {
                                   return isOneOf(v, {"start", "ready", "stop", "retire", "return", "plan"});
                               },
                               "start, ready, stop, retire, return or plan"};
const FieldKind kPoseEndField = {[](const OrderedJson& v) {
                                     return isOneOf(v, {"shown", "late", "expired", "failed"});
                                 },
                                 "shown, late, expired or failed"};
const FieldKind kTextsField = {[](const OrderedJson& v) { return v.is_array() && std::ranges::all_of(v, kText.fits); },
                               "an array of texts"};

constexpr double kNoTime = -1;
constexpr int64_t kNoWorker = -1;

void describeOptions(const Record& at, Trace::Options& options)
{
    at.field("mode", options.mode, kServiceModeField);
    at.fieldOrNull("rate", options.rate, kPositive);
    at.fieldOrNull("min_fps", options.min_fps, kPositive);
    at.fieldOrNull("max_fps", options.max_fps, kPositive);
    at.field("keeps_all", options.keeps_all, kFlag);
    at.field("devices", options.devices, kTextsField);
}

void describeCounts(const Record& at, Trace::Counts& counts)
{
    at.field("submitted", counts.submitted, kCount);
    at.field("shown", counts.shown, kCount);
    at.field("late", counts.late, kCount);
    at.field("expired", counts.expired, kCount);
    at.field("failed", counts.failed, kCount);
    at.field("still", counts.still, kCount);
    at.field("left_out", counts.left_out, kCount);
}

} // namespace

void describe(const Record& at, Trace::Sample& sample)
{
    at.field("time", sample.time, kPositive);
    at.field("fps", sample.fps, kPositive);
    at.field("workers", sample.workers, kCount);
}

void describe(const Record& at, Trace::Worker& worker)
{
    at.field("index", worker.index, kCount);
    at.field("device", worker.device, kText);
    at.field("name", worker.name, kText);
    at.field("state", worker.state, kWorkerStateField);
    at.field("frames", worker.frames, kCount);
    at.field("parts", worker.parts, kCount);
    at.field("starts", worker.starts, kCount);
    at.field("stops", worker.stops, kCount);
    at.field("faults", worker.faults, kCount);
    at.field("busy_ms", worker.busy_ms, kPositive);
    at.field("load_ms", worker.load_ms, kPositive);
    const Record stages = at.object("stage_ms");
    for (size_t i = 0; i < kStageNames.size(); ++i)
        stages.field(kStageNames[i], worker.stage_ms[i], kPositive);
    at.fieldOrNull("last_fault", worker.last_fault, kText);
}

void describe(const Record& at, Trace::Event& event)
{
    at.field("time", event.time, kPositive);
    at.field("kind", event.kind, kEventField);
    at.fieldOrNull("worker", event.worker, kCount, kNoWorker);
    at.field("cause", event.cause, kText);
    at.field("rate", event.rate, kPositive);
    at.field("workers", event.workers, kCount);
}

void describe(const Record& at, Trace::Pose& pose)
{
    at.field("id", pose.id, kCount);
    at.field("submitted", pose.submitted, kPositive);
    at.fieldOrNull("begun", pose.begun, kPositive, kNoTime);
    at.field("ended", pose.ended, kPositive);
    at.field("end", pose.end, kPoseEndField);
    at.fieldOrNull("latency_ms", pose.latency_ms, kPositive, kNoTime);
    at.check("latency_ms", (pose.end == "shown") == (pose.latency_ms != kNoTime),
             "a number of a pose that is shown, else null");
    at.fieldOrNull("worker", pose.worker, kCount, kNoWorker);
    at.fieldOrNull("mode", pose.mode, kShareField);
    at.fieldOrNull("attempts", pose.attempts, kCount);
}

void describe(const Record& at, Trace& report)
{
    std::string schema = kServiceTraceSchema;
    at.field("schema", schema, kText);
    describe(at.object("tool"), report.tool);
    at.field("file", report.file, kText);
    describeOptions(at.object("options"), report.options);
    describeCounts(at.object("counts"), report.counts);
    const Record latency = at.object("latency_ms");
    latency.field("p50", report.latency.p50, kPositive);
    latency.field("p95", report.latency.p95, kPositive);
    latency.field("p99", report.latency.p99, kPositive);
    latency.field("max", report.latency.max, kPositive);
    at.objects("rate", report.rate);
    at.objects("workers", report.workers);
    at.objects("events", report.events);
    at.objects("poses", report.poses);
}

ServiceTraceReport parseServiceTrace(const OrderedJson& json, const std::string& where)
{
    const Record record(json, where, kServiceTraceSchema);
    std::string schema;
    record.field("schema", schema, kText);
    if (schema != kServiceTraceSchema)
        throw Error(ErrorCode::Unsupported, where, "schema is " + schema, kServiceTraceSchema,
                    "use the gsc of the program that wrote it");
    ServiceTraceReport report;
    describe(record, report);
    return report;
}

} // namespace gsc
