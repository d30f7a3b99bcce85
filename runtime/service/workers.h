// SPDX-License-Identifier: Apache-2.0
// The workers of a service, as everyone but their own threads sees them: who draws, who rests, who is out of order. All of it
// is read and written with the service's mutex held.
#pragma once

#include "runtime/service/pose_queue.h"

#include <thread>

namespace gsc {

struct Worker {
    Worker(int number, DeviceId id) : index(number), device(std::move(id)) { stats.device = device; }

    const int index;
    const DeviceId device;

    WorkerState state = WorkerState::Cold;
    bool draws = false;                 // is to draw; otherwise it holds the model, so that it joins at once
    bool abandoned = false;             // it hangs: another has taken its place
    std::optional<ServiceTime> in_call; // into the renderer, since when
    ServiceTime returns{0};             // of state Retired
    uint64_t dropped = 0;               // of ServiceState::drops that it has followed
    std::vector<Job> jobs;              // that it is drawing
    uint32_t faults_in_a_row = 0;
    std::exception_ptr fault; // the last
    bool finished = false;    // its thread is about to end
    WorkerStats stats;
    std::thread thread;

    [[nodiscard]] bool loads() const { return state == WorkerState::Cold || state == WorkerState::Loading; }
    [[nodiscard]] bool isReady() const { return state == WorkerState::Warm || state == WorkerState::Working; }
    [[nodiscard]] bool isOut() const { return state == WorkerState::Retired || state == WorkerState::Gone; }
};

using WorkerPtr = std::shared_ptr<Worker>;

class ServiceWorkers {
public:
    // One for each device, none of which has a thread. `changed` wakes the workers' threads.
    ServiceWorkers(const std::vector<DeviceId>& devices, PoseQueue& poses, TraceRecord& trace,
                   std::condition_variable& changed);

    [[nodiscard]] const std::vector<WorkerPtr>& all() const { return m_all; } // by Worker::index
    [[nodiscard]] std::vector<int> working() const;
    [[nodiscard]] bool allGone() const;

    void order(Worker& worker, bool draws, const std::string& cause);

    // Takes the place of one that hangs, which is kept until its thread has ended.
    void replace(WorkerPtr fresh);
    void joinFinished();
    [[nodiscard]] std::vector<WorkerPtr> withAbandoned() const; // all that may have a thread

    void fill(ServiceStats& stats) const; // working and workers

private:
    PoseQueue& m_poses;
    TraceRecord& m_trace;
    std::condition_variable& m_changed;
    std::vector<WorkerPtr> m_all, m_abandoned;
};

} // namespace gsc
