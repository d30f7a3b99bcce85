// SPDX-License-Identifier: Apache-2.0
#include "runtime/service/workers.h"

#include <algorithm>
#include <utility>

namespace gsc {

ServiceWorkers::ServiceWorkers(const std::vector<DeviceId>& devices, PoseQueue& poses, TraceRecord& trace,
                               std::condition_variable& changed)
    : m_poses(poses), m_trace(trace), m_changed(changed)
{
    for (const DeviceId& device : devices)
        m_all.push_back(std::make_shared<Worker>(int(m_all.size()), device));
}

std::vector<int> ServiceWorkers::working() const
{
    std::vector<int> working;
    for (const WorkerPtr& worker : m_all)
        if (worker->state == WorkerState::Working && worker->draws)
            working.push_back(worker->index);
    return working;
}

bool ServiceWorkers::allGone() const
{
    return std::ranges::all_of(m_all, [](const WorkerPtr& worker) { return worker->state == WorkerState::Gone; });
}

void ServiceWorkers::order(Worker& worker, bool draws, const std::string& cause)
{
    if (std::exchange(worker.draws, draws) == draws)
        return;
    if (draws) {
        ++worker.stats.starts;
        m_trace.note(TraceEvent::Kind::Start, worker.index, cause);
    } else {
        ++worker.stats.stops;
        m_trace.note(TraceEvent::Kind::Stop, worker.index, cause);
        m_poses.freeParts(worker.index);
    }
    m_changed.notify_all();
}

void ServiceWorkers::replace(WorkerPtr fresh)
{
    WorkerPtr& place = m_all[size_t(fresh->index)];
    m_abandoned.push_back(std::exchange(place, std::move(fresh)));
}

void ServiceWorkers::joinFinished()
{
    std::erase_if(m_abandoned, [](const WorkerPtr& worker) {
        if (!worker->finished)
            return false;
        worker->thread.join();
        return true;
    });
}

std::vector<WorkerPtr> ServiceWorkers::withAbandoned() const
{
    std::vector<WorkerPtr> both = m_all;
    both.insert(both.end(), m_abandoned.begin(), m_abandoned.end());
    return both;
}

void ServiceWorkers::fill(ServiceStats& stats) const
{
    stats.working = uint32_t(working().size());
    for (const WorkerPtr& worker : m_all) {
        stats.workers.push_back(worker->stats);
        stats.workers.back().state = worker->state;
    }
}

} // namespace gsc
