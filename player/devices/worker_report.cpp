// SPDX-License-Identifier: Apache-2.0
#include "player/devices/worker_report.h"

#include "player/devices/worker_options.h"

namespace gsc {

std::optional<ServiceStats> serviceStats(const Renderer& renderer)
{
    const auto* const shared = dynamic_cast<const ServiceRenderer*>(&renderer);
    return shared != nullptr ? std::optional(shared->stats()) : std::nullopt;
}

OrderedJson workersJson(const std::optional<ServiceStats>& stats)
{
    if (!stats)
        return {};
    OrderedJson list = OrderedJson::array();
    for (const WorkerStats& worker : stats->workers)
        list.push_back({{"device", deviceText(worker.device)},
                        {"name", worker.name},
                        {"state", workerStateName(worker.state)},
                        {"parts", worker.parts},
                        {"busy_ms", worker.busy_ms},
                        {"load_ms", worker.load_ms},
                        {"starts", worker.starts},
                        {"stops", worker.stops},
                        {"faults", worker.faults},
                        {"last_fault", worker.last_fault.empty() ? OrderedJson() : OrderedJson(worker.last_fault)}});
    OrderedJson wire;
    if (const RemoteWorkers* const remote = remoteWorkers()) {
        const WireBytes bytes = remote->wire();
        wire = {{"bytes", bytes.all}, {"picture_bytes", bytes.pictures}};
    }
    return {{"mode", serviceModeName(stats->plan.mode)},
            {"sharing", stats->plan.workers},
            {"cause", stats->plan_cause.empty() ? OrderedJson() : OrderedJson(stats->plan_cause)},
            {"wire", std::move(wire)},
            {"list", std::move(list)}};
}

std::string workersText(const std::optional<ServiceStats>& stats)
{
    if (!stats)
        return {};
    std::string text = formatString("mode %s, %u of %s %s%s%s\n", serviceModeName(stats->plan.mode),
                                    stats->plan.workers, formatCount(stats->workers.size(), "worker").c_str(),
                                    stats->plan.workers == 1                 ? "draws"
                                    : stats->plan.mode == ServiceMode::Frame ? "take turns"
                                                                             : "share each frame",
                                    stats->plan_cause.empty() ? "" : ": ", stats->plan_cause.c_str());
    for (const WorkerStats& worker : stats->workers) {
        text += formatString("  %-8s %-24s %s, parts %s, busy %.0f ms, starts %u, stops %u",
                             deviceText(worker.device).c_str(), worker.name.c_str(), workerStateName(worker.state),
                             formatCount(worker.parts).c_str(), worker.busy_ms, worker.starts, worker.stops);
        text += worker.faults > 0
                    ? formatString(", faults %u, the last: %s\n", worker.faults, worker.last_fault.c_str())
                    : "\n";
    }
    return text;
}

} // namespace gsc
