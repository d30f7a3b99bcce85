// SPDX-License-Identifier: Apache-2.0
#include "runtime/service/pose_ledger.h"

#include <algorithm>
#include <utility>

namespace gsc {

const PoseLedger::Pose* PoseLedger::find(uint64_t pose) const
{
    const auto at = std::ranges::lower_bound(m_poses, pose, {}, &Pose::id);
    return at != m_poses.end() && at->id == pose ? &*at : nullptr;
}

uint64_t PoseLedger::add(ServiceTime now)
{
    Pose& pose = m_poses.emplace_back();
    pose.id = ++m_counts.submitted;
    pose.since = now;
    return pose.id;
}

void PoseLedger::end(uint64_t pose, PoseEnd how, const std::exception_ptr& error)
{
    const auto at = std::ranges::lower_bound(m_poses, pose, {}, &Pose::id);
    m_poses.erase(at);
    ++m_counts.ended[uint32_t(how)];
    m_ended.push_back({pose, how, error});
}

template <typename Which>
void PoseLedger::endAll(PoseEnd how, const Which& which)
{
    for (const Pose& pose : std::vector(m_poses.begin(), m_poses.end()))
        if (which(pose))
            end(pose.id, how);
}

void PoseLedger::failPose(Pose& pose, const std::exception_ptr& error)
{
    if (!m_rules.keeps_all)
        return end(pose.id, overtaken(pose) ? PoseEnd::Late : PoseEnd::Failed, error);
    pose.state = State::Failed; // with keeps_all, the failed pose is delivered when its turn has come
    pose.error = error;
    pose.parts.clear();
}

void PoseLedger::expire(ServiceTime now)
{
    if (m_rules.keeps_all || m_rules.timeout.count() == 0)
        return;
    endAll(PoseEnd::Expired,
           [&](const Pose& pose) { return pose.state == State::Waits && now - pose.since > m_rules.timeout; });
}

uint64_t PoseLedger::next(ServiceTime now)
{
    expire(now);
    if (m_rules.keeps_all) {
        const auto at = std::ranges::find(m_poses, State::Waits, &Pose::state);
        return at == m_poses.end() ? 0 : at->id;
    }
    uint64_t newest = 0;
    for (const Pose& pose : m_poses)
        if (pose.state == State::Waits)
            newest = pose.id;
    endAll(PoseEnd::Expired, [&](const Pose& pose) { return pose.state == State::Waits && pose.id != newest; });
    return newest;
}

void PoseLedger::begin(uint64_t pose, std::vector<PosePart> parts)
{
    Pose* const found = find(pose);
    uint32_t attempts = 0; // counts on from the earlier parts, so that a job from then is not mistaken for a new one
    for (const Part& part : found->parts)
        attempts = std::max(attempts, part.attempt);
    found->state = State::Begun;
    found->parts.clear();
    for (const PosePart& what : parts)
        found->parts.push_back({what, attempts});
}

std::optional<Job> PoseLedger::take(int worker)
{
    for (Pose& pose : m_poses)
        for (size_t i = 0; i < pose.parts.size(); ++i) {
            Part& part = pose.parts[i];
            if (part.state != Part::State::Open || (part.what.worker != kAnyWorker && part.what.worker != worker))
                continue;
            part.state = Part::State::Drawing;
            return Job{pose.id, uint32_t(i), ++part.attempt};
        }
    return std::nullopt;
}

PoseLedger::Part* PoseLedger::drawing(const Job& job)
{
    Pose* const pose = find(job.pose);
    if (pose == nullptr || job.part >= pose->parts.size())
        return nullptr;
    Part& part = pose->parts[job.part];
    return part.state == Part::State::Drawing && part.attempt == job.attempt ? &part : nullptr;
}

bool PoseLedger::isDrawing(const Job& job) const
{
    return const_cast<PoseLedger*>(this)->drawing(job) != nullptr;
}

bool PoseLedger::drawn(const Job& job)
{
    Part* const part = drawing(job);
    if (part == nullptr)
        return false;
    part->state = Part::State::Drawn;
    Pose& pose = *find(job.pose);
    if (!std::ranges::all_of(pose.parts, [](const Part& p) { return p.state == Part::State::Drawn; }))
        return true;
    pose.state = State::Drawn;
    if (overtaken(pose))
        end(pose.id, PoseEnd::Late);
    return true;
}

bool PoseLedger::giveBack(const Job& job, const std::exception_ptr& error)
{
    Part* const part = drawing(job);
    if (part == nullptr)
        return false;
    Pose& pose = *find(job.pose);
    if (overtaken(pose)) {
        end(pose.id, PoseEnd::Late);
    } else if (part->attempt >= m_rules.attempts) {
        failPose(pose, error);
    } else {
        part->what.worker = kAnyWorker;
        for (Part& any : pose.parts)
            any.state = Part::State::Open;
    }
    return true;
}

bool PoseLedger::fail(const Job& job, const std::exception_ptr& error)
{
    if (drawing(job) == nullptr)
        return false;
    failPose(*find(job.pose), error);
    return true;
}

void PoseLedger::freeParts(int worker)
{
    for (Pose& pose : m_poses)
        for (Part& part : pose.parts)
            if (part.state == Part::State::Open && part.what.worker == worker)
                part.what.worker = kAnyWorker;
}

void PoseLedger::failWaiting(const std::exception_ptr& error)
{
    std::vector<uint64_t> all;
    for (const Pose& pose : m_poses)
        if (pose.state == State::Waits || pose.state == State::Begun)
            all.push_back(pose.id);
    for (const uint64_t pose : all)
        failPose(*find(pose), error);
}

bool PoseLedger::allDrawn(uint64_t pose) const
{
    const Pose* const found = find(pose);
    return found != nullptr && found->state == State::Drawn;
}

uint64_t PoseLedger::begun() const
{
    return uint64_t(std::ranges::count(m_poses, State::Begun, &Pose::state));
}

uint64_t PoseLedger::waiting() const
{
    return uint64_t(std::ranges::count(m_poses, State::Waits, &Pose::state));
}

bool PoseLedger::canDeliver() const
{
    const auto is = [](State state) { return state == State::Drawn || state == State::Failed; };
    return m_rules.keeps_all ? !m_poses.empty() && is(m_poses.front().state)
                             : std::ranges::find(m_poses, State::Drawn, &Pose::state) != m_poses.end();
}

std::optional<EndedPose> PoseLedger::deliver()
{
    if (!canDeliver())
        return std::nullopt;
    if (m_rules.keeps_all) {
        const Pose first = m_poses.front();
        end(first.id, first.state == State::Drawn ? PoseEnd::Shown : PoseEnd::Failed, first.error);
        return m_ended.back();
    }
    const auto newest =
        std::find_if(m_poses.rbegin(), m_poses.rend(), [](const Pose& pose) { return pose.state == State::Drawn; });
    m_shown = newest->id;
    endAll(PoseEnd::Late, [&](const Pose& pose) { return pose.id < m_shown && pose.state == State::Drawn; });
    end(m_shown, PoseEnd::Shown);
    return m_ended.back();
}

std::vector<EndedPose> PoseLedger::takeEnded()
{
    return std::exchange(m_ended, {});
}

} // namespace gsc
