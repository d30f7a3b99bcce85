// SPDX-License-Identifier: Apache-2.0
// State of a service's workers: which draw, which rest, which have failed. The service's mutex must be held to read or
// write it.
#pragma once

#include "runtime/service/pose_queue.h"

#include <thread>

namespace gsc {

struct Worker {
    Worker(int number, DeviceId id) : index(number), device(std::move(id)) { stats.device = device; }

    const int index;
    const DeviceId device;

    WorkerState state = WorkerState::Cold;
    bool draws = false;                 // the worker shall draw; false: it keeps the model, to be ready at once
    bool abandoned = false;             // true: the worker hangs, and another one has taken its place
    std::optional<ServiceTime> in_call; // when the current call into the renderer began; none = not in a call
    ServiceTime returns{0};             // time when the pause ends, in state Retired
    uint64_t dropped = 0;               // value of ServiceState::drops that the worker has acted on
    std::vector<Job> jobs;              // jobs that the worker is drawing
    uint32_t faults_in_a_row = 0;
    std::exception_ptr fault; // error of the last fault
    bool finished = false;    // true once the thread is about to end
    WorkerStats stats;
    std::thread thread;

    [[nodiscard]] bool loads() const { return state == WorkerState::Cold || state == WorkerState::Loading; }
    [[nodiscard]] bool isReady() const { return state == WorkerState::Warm || state == WorkerState::Working; }
    [[nodiscard]] bool isOut() const { return state == WorkerState::Retired || state == WorkerState::Gone; }
};

using WorkerPtr = std::shared_ptr<Worker>;

class ServiceWorkers {
public:
    // Makes a worker for each device, without a thread yet. `changed` wakes the workers' threads.
    ServiceWorkers(const std::vector<DeviceId>& devices, PoseQueue& poses, TraceRecord& trace,
                   std::condition_variable& changed);

    [[nodiscard]] const std::vector<WorkerPtr>& all() const { return m_all; } // all workers; the index is Worker::index
    [[nodiscard]] std::vector<int> working() const;
    [[nodiscard]] bool allGone() const;

    void order(Worker& worker, bool draws, const std::string& cause);

    // Puts `fresh` in the place of a worker that hangs. The old one is kept until its thread has ended.
    void replace(WorkerPtr fresh);
    void joinFinished();
    [[nodiscard]] std::vector<WorkerPtr> withAbandoned() const; // returns all workers that may have a thread

    void fill(ServiceStats& stats) const; // sets `working` and `workers`

private:
    PoseQueue& m_poses;
    TraceRecord& m_trace;
    std::condition_variable& m_changed;
    std::vector<WorkerPtr> m_all, m_abandoned;
};

} // namespace gsc
