// SPDX-License-Identifier: Apache-2.0
#include "player/measure/live.h"
#include "player/devices/make_service_trace.h"
#include "player/devices/worker_report.h"

#include <algorithm>

namespace gsc {

namespace {

// Device of a worker, with the worker's number where another has the same.
std::string workerText(const std::vector<WorkerStats>& workers, size_t index)
{
    const DeviceId& device = workers[index].device;
    const bool alone = std::ranges::count(workers, device, &WorkerStats::device) == 1;
    return alone ? deviceText(device) : std::to_string(index) + ": " + deviceText(device);
}

} // namespace

ServiceTraceReport liveTrace(const LiveOptions& options, const LiveSummary& summary)
{
    const WorkerOptions& workers = options.play.devices.workers;
    ServiceTraceReport report = makeServiceTrace(summary.trace, summary.service);
    report.tool = thisTool();
    report.file = summary.file.path;
    report.options = {
        serviceModeName(workers.mode), options.rate, workers.min_fps, workers.max_fps, false, summary.devices};
    return report;
}

std::string liveReportText(const LiveOptions& options, const LiveSummary& summary)
{
    constexpr size_t kMostEvents = 40; // most lines; the trace has every event
    const LedgerCounts& counts = summary.service.counts;
    const auto of = [&](PoseEnd end) { return formatCount(counts.of(end)); };
    const LatencyStats& latency = summary.service.latency;
    const std::string still = summary.service.still > 0 ? formatString(", and %s as good as the pose before",
                                                                       formatCount(summary.service.still).c_str())
                                                        : "";
    std::string text = formatString(
        "%s at %g a second, %.2f s: %s shown (%.1f fps), %s late, %s expired, %s failed%s\n",
        formatCount(counts.submitted, "pose").c_str(), options.rate, summary.seconds, of(PoseEnd::Shown).c_str(),
        summary.seconds > 0 ? double(counts.of(PoseEnd::Shown)) / summary.seconds : 0, of(PoseEnd::Late).c_str(),
        of(PoseEnd::Expired).c_str(), of(PoseEnd::Failed).c_str(), still.c_str());
    text += formatString("latency from pose to picture: median %.2f ms, p95 %.2f ms, p99 %.2f ms, most %.2f ms\n",
                         latency.p50, latency.p95, latency.p99, latency.most);
    text += workersText(serviceFacts(summary.service));
    size_t lines = 0;
    for (const TraceEvent& event : summary.trace.events) {
        if (++lines > kMostEvents)
            break;
        const std::string who = event.worker < 0 ? "" : " " + workerText(summary.service.workers, size_t(event.worker));
        text += formatString("%8.3f s  %s%s", std::chrono::duration<double>(event.at).count(),
                             traceEventName(event.kind), who.c_str());
        text += event.cause.empty() ? "\n" : ": " + event.cause + "\n";
    }
    if (lines > kMostEvents)
        text += formatString("and %zu more; --trace FILE.json has all\n", summary.trace.events.size() - kMostEvents);
    return text;
}

} // namespace gsc
