// SPDX-License-Identifier: Apache-2.0
#include "runtime/service/sharing.h"

#include "kernels/threads/stopwatch.h"

namespace gsc {

namespace {

constexpr auto kTryAgain = std::chrono::seconds(20); // shortest time between two trials of the plans

// Returns a number for the kind of a pose: another kind may be shared best by another plan.
uint64_t kindOf(const PoseRequest& asked)
{
    const FrameOptions& options = asked.options;
    uint64_t kind = asked.eyes.size() | uint64_t(options.tier) << 2 | uint64_t(options.reuse.policy) << 4 |
                    // only whether there is detail: a guard changes how much from frame to frame
                    uint64_t(options.detail > 0) << 6;
    for (const EyeParams& eye : asked.eyes)
        kind = kind * 1000003 + eye.width * 65537ull + eye.height;
    return kind;
}

// Returns true if the picture of an eye may be empty, which the trainers draw black: a worker that draws a band of it
// cannot know.
bool mayBeEmpty(const PoseWork& work)
{
    const FrameResult all = work.result();
    return work.isCut() && work.asked.options.empty_is_black &&
           (all.eyes[0].gaussians_visible == 0 || all.eyes[work.eyeCount() - 1].gaussians_visible == 0);
}

} // namespace

std::optional<Job> Sharing::take(const Worker& worker, size_t flying)
{
    if (const std::optional<Job> job = m_poses.take(worker.index))
        return job;
    const uint64_t pose = m_poses.nextPose();
    if (pose == 0)
        return std::nullopt;
    PoseWork& work = *m_poses.work(pose);
    const std::vector<int> working = m_workers.working();
    const SharePlan plan = planFor(work, uint32_t(working.size()));
    const std::span<const int> sharing = std::span(working).first(std::min<size_t>(plan.workers, working.size()));
    // true for another worker that has nothing to do, to which a second part is left
    const auto rests = [&](int index) { return index != worker.index && m_workers.all()[size_t(index)]->jobs.empty(); };
    const bool busy = plan.mode == ServiceMode::Frame
                          ? flying >= partsAhead() || (flying > 0 && std::ranges::any_of(sharing, rests))
                          : m_poses.begun() >= partsAhead();
    if (busy || std::ranges::find(sharing, worker.index) == sharing.end())
        return std::nullopt;
    work.plan = plan;
    work.plan_serial = m_choice.serial();
    work.begun = m_clock.now();
    m_poses.begin(pose, cut(work, sharing));
    if (work.parts.size() > 1)
        m_changed.notify_all();
    return m_poses.take(worker.index);
}

SharePlan Sharing::planFor(const PoseWork& work, uint32_t workers)
{
    if (m_options.mode != ServiceMode::Auto) {
        const bool eyes = m_options.mode == ServiceMode::Eye;
        return {m_options.mode, eyes ? std::min(workers, work.eyeCount()) : workers};
    }
    const bool merged = work.asked.options.stereo == StereoMode::Merged;
    std::vector<SharePlan> plans = ModeChoice::plansFor(workers, work.eyeCount(), merged, !m_options.pace.elastic());
    const uint64_t kind = kindOf(work.asked);
    const bool drifted = m_choice.drifted() && m_clock.now() - m_tried_at > kTryAgain;
    if (plans != m_tried || kind != m_tried_kind || drifted) {
        m_choice.begin(plans);
        m_tried = std::move(plans);
        m_tried_kind = kind;
        m_tried_at = m_clock.now();
        m_trace.note(TraceEvent::Kind::Plan, -1, drifted ? "tries all: frames take another time" : "tries all");
    }
    return m_choice.plan();
}

std::vector<PosePart> Sharing::cut(const PoseWork& work, std::span<const int> workers)
{
    const std::vector<EyeParams>& eyes = work.asked.eyes;
    const uint32_t width = eyes.front().width;
    std::vector<PosePart> parts;
    if (work.plan.mode == ServiceMode::Eye && workers.size() > 1) {
        for (uint32_t e = 0; e < eyes.size(); ++e)
            parts.push_back({1u << e, {}, workers[e % workers.size()]});
    } else if (work.plan.mode == ServiceMode::Split && workers.size() > 1 && width == eyes.back().width) {
        // each band covers the same columns of every eye
        for (const ColumnRange& band : m_bands.cut(width, uint32_t(workers.size())))
            parts.push_back({work.allEyes(), band, workers[parts.size()]});
    } else {
        parts.push_back({work.allEyes(), {}, kAnyWorker});
    }
    return parts;
}

void Sharing::finish(const Job& job, PoseWork& work)
{
    if (!m_poses.drawn(job))
        return;
    if (m_poses.isOpen(job.pose) && mayBeEmpty(work)) {
        m_poses.begin(job.pose, {{work.allEyes(), {}, kAnyWorker}});
    } else {
        work.drawn = m_clock.now();
        if (!work.drawn_anew && !work.first_parts)
            learn(work);
    }
    m_changed.notify_all(); // a worker that waited for the end of this pose may begin the next
}

void Sharing::learn(const PoseWork& work)
{
    m_rates.learn(work);
    double busy = 0;
    std::vector<double> ms;
    std::vector<ColumnRange> bands;
    for (const PoseWork::Part& part : work.parts) {
        busy = std::max(busy, part.busy_ms);
        ms.push_back(part.busy_ms);
        bands.push_back(part.what.columns);
    }
    if (work.isCut())
        m_bands.learn(work.asked.eyes.front().width, bands, ms);
    if (m_options.mode == ServiceMode::Auto &&
        m_choice.add(work.plan_serial, {work.drawn, milliseconds(work.drawn - *work.begun), busy}) &&
        m_choice.decided())
        m_trace.note(TraceEvent::Kind::Plan, -1, m_choice.cause());
}

// Returns the rate for starting and stopping workers. While plans are being tried it is the best rate so far, because
// the current plan may be a slow one.
double Sharing::paceRate() const
{
    const double measured = m_rates.measured(m_workers.working().size());
    return m_choice.decided() ? measured : std::max(measured, m_choice.bestRate());
}

void Sharing::fill(ServiceStats& stats) const
{
    const bool chooses = m_options.mode == ServiceMode::Auto;
    const size_t working = m_workers.working().size();
    stats.plan = chooses ? m_choice.plan() : SharePlan{m_options.mode, uint32_t(working)};
    stats.plan_cause =
        chooses && !m_choice.decided() ? "not decided yet, all modes are still tried in turn" : m_choice.cause();
    stats.rate = m_rates.measured(working);
    stats.predicted_rate = foreseen(stats.rate);
}

} // namespace gsc
