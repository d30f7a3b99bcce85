// SPDX-License-Identifier: Apache-2.0
// The open poses of a service, and which of them is delivered next. How each stands is in the books of a PoseLedger; what it
// asks for and where it is drawn is in a PoseWork. Every call is made with the service's mutex held.
#pragma once

#include "runtime/service/pose_work.h"

#include <condition_variable>
#include <unordered_map>

namespace gsc {

class PoseQueue {
public:
    // `changed` wakes who waits for a delivery or for the end of poses.
    PoseQueue(const ServiceOptions& options, const ServiceClock& clock, TraceRecord& trace,
              std::condition_variable& changed);

    // Takes a pose; its number, or that of the last one if it shows the same (ServiceOptions::still_distance).
    uint64_t add(const std::shared_ptr<PoseWork>& work);
    // Delivers the pose that is due, as PoseLedger::deliver(), which ends it.
    std::optional<Delivery> deliver();
    [[nodiscard]] bool canDeliver() const { return m_ledger.canDeliver(); }
    [[nodiscard]] bool empty() const { return m_poses.empty(); }

    void expire();       // ends what has waited for too long
    uint64_t nextPose(); // to be begun, 0 if there is none; ends older ones
    [[nodiscard]] const std::shared_ptr<PoseWork>& work(uint64_t pose) const
    {
        return m_poses.at(pose);
    }                                                       // of an open one
    void begin(uint64_t pose, std::vector<PosePart> parts); // also anew
    [[nodiscard]] uint64_t begun() const { return m_ledger.begun(); }
    [[nodiscard]] bool isOpen(uint64_t pose) const { return m_ledger.isOpen(pose); }

    // Parts, as those of PoseLedger.
    std::optional<Job> take(int worker) { return m_ledger.take(worker); }
    [[nodiscard]] bool isDrawing(const Job& job) const { return m_ledger.isDrawing(job); }
    bool drawn(const Job& job); // true: all parts of its pose are, or it has ended
    void fail(const Job& job, const std::exception_ptr& error);
    // Gives back the parts of a worker that has a fault. Others draw them anew, into other memory: nobody knows what
    // this worker still writes.
    void giveBack(const std::vector<Job>& jobs, const std::exception_ptr& error);
    void freeParts(int worker) { m_ledger.freeParts(worker); }
    void failWaiting(const std::exception_ptr& error); // no worker is left

    void fill(ServiceStats& stats) const; // counts, still and latency

private:
    [[nodiscard]] bool isStill(const PoseWork& work) const;
    void settle();

    const ServiceOptions& m_options;
    const ServiceClock& m_clock;
    TraceRecord& m_trace;
    std::condition_variable& m_changed;
    PoseLedger m_ledger;
    std::unordered_map<uint64_t, std::shared_ptr<PoseWork>> m_poses;
    std::shared_ptr<PoseWork> m_last; // accepted
    uint64_t m_last_pose = 0;
    PoseEnd m_last_end = PoseEnd::Shown;
    bool m_last_partial = false; // it shows some of the model only
    uint64_t m_still = 0;
    LatencyCounts m_latency;
};

} // namespace gsc
