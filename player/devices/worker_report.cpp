// SPDX-License-Identifier: Apache-2.0
#include "player/devices/worker_report.h"

#include "player/devices/worker_options.h"

namespace gsc {

std::optional<ServiceStats> serviceStats(const Renderer& renderer)
{
    const auto* const shared = dynamic_cast<const ServiceRenderer*>(&renderer);
    return shared != nullptr ? std::optional(shared->stats()) : std::nullopt;
}

std::optional<ServiceFacts> serviceFacts(const std::optional<ServiceStats>& stats)
{
    if (!stats)
        return std::nullopt;
    ServiceFacts facts{serviceModeName(stats->plan.mode), stats->plan.workers, stats->plan_cause, std::nullopt, {}};
    if (const RemoteWorkers* const remote = remoteWorkers()) {
        const WireBytes bytes = remote->wire();
        facts.wire = {bytes.all, bytes.pictures};
    }
    for (const WorkerStats& worker : stats->workers)
        facts.list.push_back({deviceText(worker.device), worker.name, workerStateName(worker.state), worker.parts,
                              worker.busy_ms, worker.load_ms, worker.starts, worker.stops, worker.faults,
                              worker.last_fault});
    return facts;
}

OrderedJson workersJson(const std::optional<ServiceStats>& stats)
{
    const std::optional<ServiceFacts> facts = serviceFacts(stats);
    return facts ? toJson(*facts) : OrderedJson();
}

std::string workersText(const std::optional<ServiceFacts>& service)
{
    if (!service)
        return {};
    std::string text = formatString("mode %s, %llu of %s %s%s%s\n", service->mode.c_str(),
                                    static_cast<unsigned long long>(service->sharing),
                                    formatCount(service->list.size(), "worker").c_str(),
                                    service->sharing == 1                                  ? "draws"
                                    : service->mode == serviceModeName(ServiceMode::Frame) ? "take turns"
                                                                                           : "share each frame",
                                    service->cause.empty() ? "" : ": ", service->cause.c_str());
    for (const WorkerFacts& worker : service->list) {
        text += formatString("  %-8s %-24s %s, parts %s, busy %.0f ms, starts %s, stops %s", worker.device.c_str(),
                             worker.name.c_str(), worker.state.c_str(), formatCount(worker.parts).c_str(),
                             worker.busy_ms, formatCount(worker.starts).c_str(), formatCount(worker.stops).c_str());
        text += worker.faults > 0 ? formatString(", faults %s, the last: %s\n", formatCount(worker.faults).c_str(),
                                                 worker.last_fault.c_str())
                                  : "\n";
    }
    return text;
}

} // namespace gsc
