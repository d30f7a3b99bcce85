// SPDX-License-Identifier: Apache-2.0
#include "player/devices/make_service_trace.h"

#include <algorithm>
#include <cmath>

namespace gsc {

namespace {

constexpr double kRateIntervals = 120;
constexpr double kShortestInterval = 0.1; // shortest interval that rates are counted over, seconds

double secondsOf(ServiceTime time)
{
    return std::chrono::duration<double>(time).count();
}

ServiceTraceReport::Stages stagesOf(const StageTimes& times)
{
    return {times.select, times.decode, times.project, times.bin, times.sort, times.blend};
}

// Set of the workers that draw at a moment, kept up to date by the events of a trace in order of time. A worker that
// was started counts only once it has loaded the model.
class WorkingWorkers {
public:
    explicit WorkingWorkers(size_t count) : m_workers(count) {}

    void follow(const TraceEvent& event)
    {
        if (event.worker < 0)
            return;
        m_workers.resize(std::max(m_workers.size(), size_t(event.worker) + 1));
        State& state = m_workers[size_t(event.worker)];
        switch (event.kind) {
        case TraceEvent::Kind::Start:
            state.started = true;
            break;
        case TraceEvent::Kind::Stop:
            state.started = false;
            break;
        case TraceEvent::Kind::Ready:
            state.ready = true;
            break;
        case TraceEvent::Kind::Retire:
            state.ready = false;
            break;
        case TraceEvent::Kind::Return:
        case TraceEvent::Kind::Plan:
            break;
        }
    }

    [[nodiscard]] uint64_t count() const
    {
        return uint64_t(std::ranges::count_if(m_workers, [](const State& s) { return s.started && s.ready; }));
    }

private:
    struct State {
        bool started = false, ready = false;
    };
    std::vector<State> m_workers;
};

std::vector<double> timesShown(const ServiceTrace& trace)
{
    std::vector<double> times;
    for (const TracePose& pose : trace.poses)
        if (pose.end == PoseEnd::Shown)
            times.push_back(secondsOf(pose.ended));
    std::ranges::sort(times);
    return times;
}

// Number of the values that are > from and <= to. `ascending` is sorted.
double countBetween(const std::vector<double>& ascending, double from, double to)
{
    return double(std::ranges::upper_bound(ascending, to) - std::ranges::upper_bound(ascending, from));
}

std::vector<ServiceTraceReport::Sample> rateOver(const ServiceTrace& trace, const std::vector<double>& shown,
                                                 size_t workers)
{
    double end = 0;
    for (const TracePose& pose : trace.poses)
        end = std::max(end, secondsOf(pose.ended));
    for (const TraceEvent& event : trace.events)
        end = std::max(end, secondsOf(event.at));
    const double interval = std::max(end / kRateIntervals, kShortestInterval);
    // number of intervals; the last one ends with the run
    const double count = std::max(1.0, std::floor(end / interval + 0.5));
    std::vector<ServiceTraceReport::Sample> samples;
    WorkingWorkers working(workers);
    auto event = trace.events.begin();
    for (double i = 0; i < count && end > 0; ++i) {
        const double from = i * interval, to = i + 1 < count ? (i + 1) * interval : end;
        for (; event != trace.events.end() && secondsOf(event->at) <= to; ++event)
            working.follow(*event);
        samples.push_back({to, countBetween(shown, from, to) / (to - from), working.count()});
    }
    return samples;
}

} // namespace

ServiceTraceReport makeServiceTrace(const ServiceTrace& trace, const ServiceStats& stats)
{
    ServiceTraceReport report;
    const LedgerCounts& counts = stats.counts;
    report.counts = {.submitted = counts.submitted,
                     .shown = counts.of(PoseEnd::Shown),
                     .late = counts.of(PoseEnd::Late),
                     .expired = counts.of(PoseEnd::Expired),
                     .failed = counts.of(PoseEnd::Failed),
                     .still = stats.still,
                     .left_out = trace.left_out};
    report.latency = {stats.latency.p50, stats.latency.p95, stats.latency.p99, stats.latency.most};
    for (size_t i = 0; i < stats.workers.size(); ++i) {
        const WorkerStats& worker = stats.workers[i];
        report.workers.push_back({.index = i,
                                  .device = deviceText(worker.device),
                                  .name = worker.name,
                                  .state = workerStateName(worker.state),
                                  .parts = worker.parts,
                                  .starts = worker.starts,
                                  .stops = worker.stops,
                                  .faults = worker.faults,
                                  .busy_ms = worker.busy_ms,
                                  .load_ms = worker.load_ms,
                                  .last_fault = worker.last_fault});
    }
    const std::vector<double> shown = timesShown(trace);
    report.rate = rateOver(trace, shown, stats.workers.size());
    WorkingWorkers working(stats.workers.size());
    for (const TraceEvent& event : trace.events) {
        working.follow(event);
        const double at = secondsOf(event.at), before = std::min(at, 1.0);
        report.events.push_back({.time = at,
                                 .kind = traceEventName(event.kind),
                                 .worker = event.worker,
                                 .cause = event.cause,
                                 .rate = before > 0 ? countBetween(shown, at - before, at) / before : 0,
                                 .workers = working.count()});
    }
    for (const TracePose& pose : trace.poses) {
        const double submitted = secondsOf(pose.submitted), ended = secondsOf(pose.ended);
        report.poses.push_back({.id = pose.pose,
                                .submitted = submitted,
                                .ended = ended,
                                .begun = pose.begun ? secondsOf(*pose.begun) : -1,
                                .end = poseEndName(pose.end),
                                .latency_ms = pose.end == PoseEnd::Shown ? 1e3 * (ended - submitted) : -1,
                                .worker = pose.worker});
        if (pose.worker < 0 || size_t(pose.worker) >= report.workers.size())
            continue;
        ServiceTraceReport::Worker& worker = report.workers[size_t(pose.worker)];
        ++worker.frames;
        const ServiceTraceReport::Stages stages = stagesOf(pose.stages);
        for (size_t i = 0; i < stages.size(); ++i)
            worker.stage_ms[i] += stages[i];
    }
    return report;
}

} // namespace gsc
