// SPDX-License-Identifier: Apache-2.0
#include "convert/chart/trace_model.h"

#include "convert/chart/rounded.h"
#include "convert/chart/run_words.h"
#include <gsc/error.h>
#include "runtime/cli/reporter.h"

#include <algorithm>
#include <filesystem>
#include <numeric>
#include <set>

namespace gsc {

namespace {

using TraceJson = nlohmann::ordered_json;

constexpr size_t kBuckets = 40; // steps of the distribution, up to 1.25 times the 99th percentile
constexpr size_t kCdfPoints = 200;
constexpr size_t kMostEvents = 2000; // most events that a page lists and marks

// `count` of the values, evenly spaced.
template <typename T>
std::vector<const T*> spreadOver(const std::vector<const T*>& values, size_t count)
{
    if (values.size() <= count)
        return values;
    std::vector<const T*> kept;
    for (size_t i = 0; i < count; ++i)
        kept.push_back(values[i * values.size() / count]);
    return kept;
}

TraceJson posesJson(const ChartTrace& trace)
{
    TraceJson json;
    for (const char* end : {"shown", "late", "expired", "failed"}) {
        std::vector<const ServiceTraceReport::Pose*> poses;
        for (const ServiceTraceReport::Pose& pose : trace.poses)
            if (pose.end == end)
                poses.push_back(&pose);
        TraceJson points = TraceJson::array();
        for (const ServiceTraceReport::Pose* pose : spreadOver(poses, kMostTracePoses))
            points.push_back(TraceJson::array(
                {rounded(pose->ended), rounded(std::max(0.0, 1e3 * (pose->ended - pose->submitted)))}));
        json[end] = std::move(points);
    }
    return json;
}

// The smallest step of 1, 2 or 5 times a power of ten such that `most` steps reach `span`.
double roundStep(double span, size_t most)
{
    const double least = std::max(span, 1e-6) / double(most), power = std::pow(10, std::floor(std::log10(least)));
    for (const double factor : {1.0, 2.0, 5.0})
        if (factor * power >= least * (1 - 1e-9))
            return factor * power;
    return 10 * power;
}

TraceJson distributionJson(const ChartTrace& trace)
{
    std::vector<double> ms;
    for (const ServiceTraceReport::Pose& pose : trace.poses)
        if (pose.latency_ms >= 0)
            ms.push_back(pose.latency_ms);
    std::ranges::sort(ms);
    if (ms.empty())
        return nullptr;
    const double step = roundStep(std::min(1.25 * nearestRank(ms, 0.99), ms.back()), kBuckets);
    std::vector<uint64_t> counts;
    uint64_t over = 0;
    for (const double value : ms) {
        const double bucket = value / step;
        if (bucket >= kBuckets) {
            ++over;
            continue;
        }
        counts.resize(std::max(counts.size(), size_t(bucket) + 1));
        ++counts[size_t(bucket)];
    }
    TraceJson cdf = TraceJson::array();
    const size_t points = std::min(kCdfPoints, ms.size());
    for (size_t i = 1; i <= points; ++i) {
        const double share = double(i) / double(points);
        cdf.push_back(TraceJson::array({rounded(nearestRank(ms, share)), rounded(100 * share)}));
    }
    return {{"step", rounded(step)}, {"counts", counts}, {"over", over}, {"cdf", std::move(cdf)}};
}

double endOf(const ChartTrace& trace)
{
    double end = 0;
    for (const ServiceTraceReport::Sample& sample : trace.rate)
        end = std::max(end, sample.time);
    for (const ServiceTraceReport::Pose& pose : trace.poses)
        end = std::max(end, pose.ended);
    for (const ServiceTraceReport::Event& event : trace.events)
        end = std::max(end, event.time);
    return end;
}

// Times from which and until which each worker drew, ready and started: [[from, until], ...] for each worker.
std::vector<TraceJson> spansOf(const ChartTrace& trace, double end)
{
    struct State {
        bool started = false, ready = false, draws = false;
        double since = 0;
    };
    std::vector<State> states(trace.workers.size());
    std::vector<TraceJson> spans(trace.workers.size(), TraceJson::array());
    const auto close = [&](size_t worker, double time) {
        if (states[worker].draws)
            spans[worker].push_back(TraceJson::array({rounded(states[worker].since), rounded(time)}));
    };
    for (const ServiceTraceReport::Event& event : trace.events) {
        if (event.worker < 0 || size_t(event.worker) >= states.size())
            continue;
        State& state = states[size_t(event.worker)];
        state.started = event.kind == "start" || (state.started && event.kind != "stop");
        state.ready = event.kind == "ready" || (state.ready && event.kind != "retire");
        const bool draws = state.started && state.ready;
        if (draws == state.draws)
            continue;
        close(size_t(event.worker), event.time);
        state.draws = draws;
        state.since = event.time;
    }
    for (size_t worker = 0; worker < states.size(); ++worker)
        close(worker, end);
    return spans;
}

TraceJson workersJson(const ChartTrace& trace, double seconds)
{
    TraceJson list = TraceJson::array();
    const std::vector<TraceJson> spans = spansOf(trace, seconds);
    for (const ServiceTraceReport::Worker& worker : trace.workers) {
        TraceJson stages = TraceJson::array();
        for (const double ms : worker.stage_ms)
            stages.push_back(rounded(1e-3 * ms));
        const double told = std::accumulate(worker.stage_ms.begin(), worker.stage_ms.end(), 0.0);
        list.push_back({{"index", worker.index},
                        {"device", worker.device},
                        {"name", worker.name},
                        {"state", worker.state},
                        {"frames", worker.frames},
                        {"parts", worker.parts},
                        {"faults", worker.faults},
                        {"busy_s", rounded(1e-3 * worker.busy_ms)},
                        {"busy_share", seconds > 0 ? rounded(1e-3 * worker.busy_ms / seconds) : TraceJson()},
                        {"load_ms", rounded(worker.load_ms)},
                        {"spans", spans[list.size()]},
                        {"stage_s", std::move(stages)},
                        {"untold_s", rounded(1e-3 * std::max(0.0, worker.busy_ms - told))},
                        {"last_fault", worker.last_fault}});
    }
    return list;
}

TraceJson eventsJson(const ChartTrace& trace)
{
    TraceJson list = TraceJson::array();
    for (size_t i = 0; i < std::min(trace.events.size(), kMostEvents); ++i) {
        const ServiceTraceReport::Event& event = trace.events[i];
        list.push_back({{"time", rounded(event.time)},
                        {"kind", event.kind},
                        {"worker", event.worker < 0 ? TraceJson() : TraceJson(event.worker)},
                        {"cause", event.cause},
                        {"rate", rounded(event.rate)},
                        {"workers", event.workers}});
    }
    return list;
}

std::string wordsOfOptions(const ChartTrace& trace)
{
    const ServiceTraceReport::Options& options = trace.options;
    std::string words = std::filesystem::path(trace.file).filename().string() + ", mode " + options.mode;
    words +=
        options.rate > 0 ? formatString(", %.4g poses a second", options.rate) : ", poses as fast as they are drawn";
    if (options.min_fps > 0)
        words += formatString(", at least %.4g fps", options.min_fps);
    if (options.max_fps > 0)
        words += formatString(", at most %.4g fps", options.max_fps);
    words += options.keeps_all ? ", all poses kept" : ", the newest pose wins";
    std::string devices;
    for (const std::string& device : options.devices)
        devices += (devices.empty() ? "" : ", ") + device;
    return words + (devices.empty() ? "" : "; devices " + devices);
}

std::string verdictOf(const ChartTrace& trace, double seconds)
{
    const ServiceTraceReport::Counts& counts = trace.counts;
    std::string words = formatCount(counts.shown) + " of " + formatCount(counts.submitted) + " poses shown";
    if (seconds > 0)
        words += formatString(" in %.4g s, %.4g a second", seconds, double(counts.shown) / seconds);
    const auto add = [&words](uint64_t count, const char* what) {
        if (count > 0)
            words += ", " + formatCount(count) + what;
    };
    add(counts.late, " late");
    add(counts.expired, " expired");
    add(counts.failed, " failed");
    add(counts.still, " not drawn because they stood still");
    if (counts.shown > 0)
        words += formatString(". Latency %.4g ms in the median, %.4g ms at p99, %.4g ms at most", trace.latency.p50,
                              trace.latency.p99, trace.latency.max);
    if (counts.left_out > 0)
        words += ". The trace was full: " + formatCount(counts.left_out) + " poses and events are not in the figures";
    return words + ".";
}

TraceJson tracePanel(const ChartTrace& trace, const std::string& file_name)
{
    const double end = endOf(trace);
    TraceJson rate = TraceJson::array();
    for (const ServiceTraceReport::Sample& sample : trace.rate)
        rate.push_back(TraceJson::array({rounded(sample.time), rounded(sample.fps), sample.workers}));
    const auto limit = [](double fps) { return fps > 0 ? rounded(fps) : TraceJson(); };
    return {{"title", trace.title},
            {"file_name", file_name},
            {"words", wordsOfOptions(trace)},
            {"verdict", verdictOf(trace, end)},
            {"latency",
             {{"p50", rounded(trace.latency.p50)},
              {"p95", rounded(trace.latency.p95)},
              {"p99", rounded(trace.latency.p99)},
              {"max", rounded(trace.latency.max)}}},
            {"min_fps", limit(trace.options.min_fps)},
            {"max_fps", limit(trace.options.max_fps)},
            {"end", rounded(end)},
            {"rate", std::move(rate)},
            {"poses", posesJson(trace)},
            {"distribution", distributionJson(trace)},
            {"stages", kStageNames},
            {"workers", workersJson(trace, end)},
            {"events", eventsJson(trace)},
            {"events_cut", trace.events.size() > kMostEvents || trace.counts.left_out > 0}};
}

TraceJson traceFacts(const std::vector<ChartTrace>& traces)
{
    std::vector<std::string> files, tools;
    const auto addOnce = [](std::vector<std::string>& list, const std::string& words) {
        if (!words.empty() && std::ranges::find(list, words) == list.end())
            list.push_back(words);
    };
    for (const ChartTrace& trace : traces) {
        addOnce(files, trace.file);
        addOnce(tools, trace.tool.name + " " + trace.tool.version +
                           (trace.tool.commit.empty() ? "" : " (" + trace.tool.commit + ")"));
    }
    const auto joined = [](const std::vector<std::string>& list) {
        std::string text;
        for (const std::string& words : list)
            text += (text.empty() ? "" : "; ") + words;
        return text;
    };
    TraceJson facts = TraceJson::array();
    facts.push_back(TraceJson::array({"Model", joined(files)}));
    facts.push_back(TraceJson::array({"Measured with", joined(tools)}));
    facts.push_back(TraceJson::array({"Traces", std::to_string(traces.size())}));
    return facts;
}

} // namespace

TraceJson traceModel(const std::vector<ChartTrace>& traces)
{
    TraceJson panels = TraceJson::array();
    std::set<std::string> file_names;
    for (const ChartTrace& trace : traces) {
        const std::string plain = fileNameOf(trace.title);
        std::string name = plain;
        for (size_t copy = 2; !file_names.insert(name).second; ++copy)
            name = plain + "-" + std::to_string(copy);
        panels.push_back(tracePanel(trace, name));
    }
    return {
        {"version", GSC_VERSION}, {"kind", "service"}, {"facts", traceFacts(traces)}, {"panels", std::move(panels)}};
}

} // namespace gsc
