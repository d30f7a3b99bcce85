// SPDX-License-Identifier: Apache-2.0
// The open poses of a service, and the order of their delivery. A PoseLedger holds the state of each pose, a PoseWork
// its request and its memory. The service's mutex must be held in every call.
#pragma once

#include "runtime/service/pose_work.h"

#include <condition_variable>
#include <unordered_map>

namespace gsc {

class PoseQueue {
public:
    // `changed` wakes threads that wait for a delivery or for the end of poses.
    PoseQueue(const ServiceOptions& options, const ServiceClock& clock, TraceRecord& trace,
              std::condition_variable& changed);

    // Adds a pose. Returns its number, or that of the last pose if both show the same
    // (ServiceOptions::still_distance).
    uint64_t add(const std::shared_ptr<PoseWork>& work);
    // Delivers the pose whose turn it is and ends it, as PoseLedger::deliver() does.
    std::optional<Delivery> deliver();
    [[nodiscard]] bool canDeliver() const { return m_ledger.canDeliver(); }
    [[nodiscard]] bool empty() const { return m_poses.empty(); }

    void expire();       // ends poses that have waited too long
    uint64_t nextPose(); // returns the pose to begin next, 0 = none; may end older ones
    // Returns the work of a pose. Precondition: the pose is open.
    [[nodiscard]] const std::shared_ptr<PoseWork>& work(uint64_t pose) const { return m_poses.at(pose); }
    void begin(uint64_t pose, std::vector<PosePart> parts); // begins a pose, also for a second time
    [[nodiscard]] uint64_t begun() const { return m_ledger.begun(); }
    [[nodiscard]] bool isOpen(uint64_t pose) const { return m_ledger.isOpen(pose); }

    // These functions do the same as those of PoseLedger with equal names.
    std::optional<Job> take(int worker) { return m_ledger.take(worker); }
    [[nodiscard]] bool isDrawing(const Job& job) const { return m_ledger.isDrawing(job); }
    bool drawn(const Job& job); // returns true if all parts of the pose are drawn, or it has ended
    void fail(const Job& job, const std::exception_ptr& error);
    // Gives back the parts of a worker that failed. Other workers draw them again, into new memory: the failed one may
    // still write into the old.
    void giveBack(const std::vector<Job>& jobs, const std::exception_ptr& error);
    void freeParts(int worker) { m_ledger.freeParts(worker); }
    void failWaiting(const std::exception_ptr& error); // reports that no worker is left: open poses fail

    void fill(ServiceStats& stats) const; // sets counts, still and latency

private:
    [[nodiscard]] bool isStill(const PoseWork& work) const;
    void settle();

    const ServiceOptions& m_options;
    const ServiceClock& m_clock;
    TraceRecord& m_trace;
    std::condition_variable& m_changed;
    PoseLedger m_ledger;
    std::unordered_map<uint64_t, std::shared_ptr<PoseWork>> m_poses;
    std::shared_ptr<PoseWork> m_last; // pose that was accepted last
    uint64_t m_last_pose = 0;
    PoseEnd m_last_end = PoseEnd::Shown;
    // the last picture shows only a part of the model, because anchors are still being loaded
    bool m_last_partial = false;
    uint64_t m_still = 0;
    LatencyCounts m_latency;
};

} // namespace gsc
