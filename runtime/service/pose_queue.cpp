// SPDX-License-Identifier: Apache-2.0
#include "runtime/service/pose_queue.h"

#include "kernels/threads/stopwatch.h"

#include <algorithm>

namespace gsc {

PoseQueue::PoseQueue(const ServiceOptions& options, const ServiceClock& clock, TraceRecord& trace,
                     std::condition_variable& changed)
    : m_options(options), m_clock(clock), m_trace(trace), m_changed(changed),
      m_ledger({options.keeps_all, options.timeout, options.attempts})
{
}

bool PoseQueue::isStill(const PoseWork& work) const
{
    if (work.late != nullptr) // a pose with `late` gets its eyes only when it is begun, so they cannot be compared
        return false;
    if (m_last == nullptr || (m_options.still_distance <= 0 && m_options.still_degrees <= 0))
        return false;
    const bool shows = m_ledger.isOpen(m_last_pose) || (m_last_end == PoseEnd::Shown && !m_last_partial);
    return shows && work.showsSameAs(*m_last, m_options.still_distance, m_options.still_degrees);
}

uint64_t PoseQueue::add(const std::shared_ptr<PoseWork>& work)
{
    if (isStill(*work)) {
        ++m_still;
        return m_last_pose;
    }
    work->submitted = m_clock.now();
    m_last_pose = m_ledger.add(work->submitted);
    m_last = work;
    m_poses.emplace(m_last_pose, work);
    return m_last_pose;
}

std::optional<Delivery> PoseQueue::deliver()
{
    const std::optional<EndedPose> ended = m_ledger.deliver();
    if (!ended)
        return std::nullopt;
    const PoseWork& work = *m_poses.at(ended->pose);
    Delivery delivery{*ended};
    delivery.submitted = work.submitted;
    delivery.begun = work.begun.value_or(work.submitted);
    delivery.drawn = work.drawn;
    delivery.delivered = m_clock.now();
    if (ended->end == PoseEnd::Shown) {
        for (uint32_t e = 0; e < work.eyeCount(); ++e)
            delivery.eyes[e] = work.target(e, work.pictures->kind(), work.memory.get());
        delivery.memory = work.memory;
        delivery.result = work.result();
        m_latency.add(milliseconds(delivery.delivered - delivery.submitted));
    }
    settle();
    return delivery;
}

void PoseQueue::expire()
{
    m_ledger.expire(m_clock.now());
    settle();
}

uint64_t PoseQueue::nextPose()
{
    if (m_ledger.waiting() == 0)
        return 0;
    const uint64_t pose = m_ledger.next(m_clock.now());
    settle();
    return pose;
}

void PoseQueue::begin(uint64_t pose, std::vector<PosePart> parts)
{
    m_poses.at(pose)->setParts(parts);
    m_ledger.begin(pose, std::move(parts));
}

bool PoseQueue::drawn(const Job& job)
{
    m_ledger.drawn(job);
    settle();
    return !m_ledger.isOpen(job.pose) || m_ledger.allDrawn(job.pose);
}

void PoseQueue::fail(const Job& job, const std::exception_ptr& error)
{
    m_ledger.fail(job, error);
    settle();
}

void PoseQueue::giveBack(const std::vector<Job>& jobs, const std::exception_ptr& error)
{
    for (const Job& job : jobs) {
        if (!m_ledger.giveBack(job, error))
            continue;
        const auto found = m_poses.find(job.pose);
        if (found != m_poses.end())
            found->second = found->second->again();
    }
    settle();
}

void PoseQueue::failWaiting(const std::exception_ptr& error)
{
    m_ledger.failWaiting(error);
    settle();
}

// Drops the poses that have ended in the ledger.
void PoseQueue::settle()
{
    for (const EndedPose& ended : m_ledger.takeEnded()) {
        const auto found = m_poses.find(ended.pose);
        if (found == m_poses.end())
            continue;
        const PoseWork& work = *found->second;
        if (ended.pose == m_last_pose) {
            m_last_end = ended.end;
            m_last_partial = work.result().anchors_absent > 0;
        }
        const auto longest = std::ranges::max_element(work.parts, {}, &PoseWork::Part::busy_ms);
        const bool any = longest != work.parts.end();
        m_trace.add({ended.pose, work.submitted, m_clock.now(), work.begun, ended.end, any ? longest->worker : -1,
                     any ? longest->result.times : StageTimes{}, work.load()});
        m_poses.erase(found);
        m_changed.notify_all();
    }
    if (m_ledger.canDeliver()) // a failed pose may be due for delivery, too
        m_changed.notify_all();
}

void PoseQueue::fill(ServiceStats& stats) const
{
    stats.counts = m_ledger.counts();
    stats.still = m_still;
    stats.latency = m_latency.stats();
}

} // namespace gsc
