// SPDX-License-Identifier: Apache-2.0
// What happens with the mutex held: which worker draws what, how many draw, what has ended.
#include "runtime/service/service_core.h"

#include <gsc/error.h>
#include "kernels/threads/stopwatch.h"

#include <algorithm>
#include <utility>

namespace gsc {

namespace {

constexpr auto kLook = std::chrono::milliseconds(5);           // between two looks of the keeper
constexpr auto kTryAgain = std::chrono::seconds(20);           // plans after a drift, at the soonest
constexpr ServiceTime kAhead = std::chrono::milliseconds(100); // what a started worker is good for
constexpr double kMeanOf = 8;                                  // frames

} // namespace

std::vector<int> RendererService::Core::working() const
{
    std::vector<int> all;
    for (const WorkerPtr& worker : m_workers)
        if (worker->state == WorkerState::Working && worker->order == Worker::Order::Work)
            all.push_back(worker->index);
    return all;
}

bool RendererService::Core::allGone() const
{
    return std::ranges::all_of(m_workers, [](const WorkerPtr& w) { return w->state == WorkerState::Gone; });
}

SharePlan RendererService::Core::planFor(const PoseWork& work)
{
    const auto workers = uint32_t(working().size());
    if (m_options.mode != ServiceMode::Auto) {
        const bool eyes = m_options.mode == ServiceMode::Eye;
        return {m_options.mode, eyes ? std::min(workers, work.eye_count) : workers};
    }
    const bool merged = work.options.stereo == StereoMode::Merged;
    std::vector<SharePlan> plans = ModeChoice::plansFor(workers, work.eye_count, merged, !m_rules.elastic());
    uint64_t shape = work.eye_count | uint64_t(work.options.tier) << 2 | uint64_t(work.options.reuse.policy) << 4;
    for (uint32_t e = 0; e < work.eye_count; ++e)
        shape = shape * 1000003 + work.eyes[e].width * 65537ull + work.eyes[e].height;
    const bool drifted = m_choice.drifted() && now() - m_tried_at > kTryAgain;
    if (plans != m_tried || shape != m_tried_shape || drifted) {
        m_choice.begin(plans);
        m_tried = std::move(plans);
        m_tried_shape = shape;
        m_tried_at = now();
        note(TraceEvent::Kind::Plan, -1, drifted ? "tries all: frames take another time" : "tries all");
    }
    return m_choice.plan();
}

// Another that shares the plan has nothing to do, so that a second part is better left to it.
bool RendererService::Core::othersRest(const Worker& worker, size_t sharing) const
{
    size_t seen = 0;
    for (const int index : working()) {
        if (seen++ >= sharing)
            break;
        if (index != worker.index && m_workers[size_t(index)]->jobs.empty())
            return true;
    }
    return false;
}

std::optional<Job> RendererService::Core::take(Worker& worker, size_t flying)
{
    if (const std::optional<Job> job = m_ledger.take(worker.index))
        return job;
    if (m_ledger.waiting() == 0)
        return std::nullopt;
    const std::vector<int> all = working();
    // a look at the pose that comes next decides who draws it; taking it for good ends older ones
    const uint64_t first = m_ledger.next(now());
    if (first == 0) {
        settle();
        return std::nullopt;
    }
    PoseWork& work = *m_poses.at(first);
    const SharePlan plan = planFor(work);
    const size_t sharing = std::min<size_t>(plan.workers, all.size());
    const auto me = std::ranges::find(all, worker.index);
    if (me == all.end() || size_t(me - all.begin()) >= sharing)
        return std::nullopt;
    const size_t ahead = partsAhead();
    if (plan.mode == ServiceMode::Frame ? flying >= ahead || (flying > 0 && othersRest(worker, sharing))
                                        : m_ledger.begun() >= ahead)
        return std::nullopt;
    work.plan = plan;
    work.plan_serial = m_choice.serial();
    begin(first, work, std::vector<int>(all.begin(), all.begin() + std::ptrdiff_t(sharing)));
    settle();
    return m_ledger.take(worker.index);
}

// Cuts a pose into parts.
void RendererService::Core::begin(uint64_t pose, PoseWork& work, const std::vector<int>& sharing)
{
    const uint32_t both = (1u << work.eye_count) - 1;
    std::vector<PosePart> parts;
    if (work.plan.mode == ServiceMode::Eye && sharing.size() > 1) {
        for (uint32_t e = 0; e < work.eye_count; ++e)
            parts.push_back({1u << e, {}, sharing[e % sharing.size()]});
    } else if (work.plan.mode == ServiceMode::Split && sharing.size() > 1 &&
               work.eyes[0].width == work.eyes[work.eye_count - 1].width) { // columns are those of every eye
        const std::vector<ColumnRange> bands = m_bands.cut(work.eyes[0].width, uint32_t(sharing.size()));
        for (size_t i = 0; i < bands.size(); ++i)
            parts.push_back({both, bands[i], sharing[i]});
    } else {
        parts.push_back({both, {}, kAnyWorker});
    }
    work.begun = now();
    work.parts.clear();
    for (const PosePart& part : parts)
        work.parts.push_back({part, -1, 0, {}});
    const bool several = parts.size() > 1;
    m_ledger.begin(pose, std::move(parts));
    if (several)
        m_work.notify_all();
}

// After a part was drawn: is all of the pose?
void RendererService::Core::noteDrawn(uint64_t pose, const std::shared_ptr<PoseWork>& work)
{
    if (m_ledger.isOpen(pose) && !m_ledger.allDrawn(pose))
        return;
    uint64_t gaussians[kMaxEyes] = {};
    bool cut = false;
    for (const PoseWork::Part& part : work->parts) {
        cut = cut || !part.what.columns.all();
        for (uint32_t e = 0; e < kMaxEyes; ++e)
            gaussians[e] += part.result.eyes[e].gaussians_visible;
    }
    const bool empty = gaussians[0] == 0 || gaussians[work->eye_count - 1] == 0; // an eye of two
    if (cut && empty && work->options.empty_is_black && m_ledger.isOpen(pose)) {
        // no band knows whether the picture of its eye is empty, which the trainers make black
        work->parts = {{{(1u << work->eye_count) - 1, {}, kAnyWorker}, -1, 0, {}}};
        m_ledger.begin(pose, {work->parts.front().what});
        m_work.notify_all();
        return;
    }
    work->drawn = now();
    double busy = 0, sum = 0;
    std::vector<double> ms;
    std::vector<ColumnRange> bands;
    FrameLoad load;
    for (const PoseWork::Part& part : work->parts) {
        busy = std::max(busy, part.busy_ms);
        sum += part.busy_ms;
        ms.push_back(part.busy_ms);
        bands.push_back(part.what.columns);
        const FrameLoad own = loadOf(part.result);
        load = {load.anchors + own.anchors, load.pairs + own.pairs, load.evaluations + own.evaluations};
    }
    if (!work->again && !work->first) {
        m_cost.learn(*work->begun, load, work->plan.mode == ServiceMode::Frame ? sum : busy);
        if (cut)
            m_bands.learn(work->eyes[0].width, bands, ms);
        if (std::exchange(m_span_plan, work->plan) != work->plan)
            m_span_ms = 0;
        m_span_ms = m_span_ms == 0 ? busy : m_span_ms + (busy - m_span_ms) / kMeanOf;
        if (m_options.mode == ServiceMode::Auto &&
            m_choice.add(work->plan_serial, {work->drawn, milliseconds(work->drawn - *work->begun), busy}) &&
            m_choice.decided())
            note(TraceEvent::Kind::Plan, -1, m_choice.cause());
    }
    settle();
    m_done.notify_all();
    m_work.notify_all(); // one that waited for this pose to be drawn may begin the next
}

// Ends what the ledger says has ended.
void RendererService::Core::settle()
{
    for (const EndedPose& ended : m_ledger.takeEnded()) {
        const auto found = m_poses.find(ended.pose);
        if (ended.pose == m_last_pose) {
            m_last_end = ended.end;
            m_last_partial = found != m_poses.end() && found->second->result().anchors_absent > 0;
        }
        if (found == m_poses.end())
            continue;
        const PoseWork& work = *found->second;
        if (m_trace.poses.size() < m_options.trace_limit) {
            TracePose& pose = m_trace.poses.emplace_back();
            pose.pose = ended.pose;
            pose.submitted = work.submitted;
            pose.ended = now();
            pose.begun = work.begun;
            pose.end = ended.end;
            const auto longest = std::ranges::max_element(work.parts, {}, &PoseWork::Part::busy_ms);
            if (longest != work.parts.end()) {
                pose.worker = longest->worker;
                pose.stages = longest->result.times;
            }
            for (const PoseWork::Part& part : work.parts) {
                const FrameLoad own = loadOf(part.result);
                pose.load = {pose.load.anchors + own.anchors, pose.load.pairs + own.pairs,
                             pose.load.evaluations + own.evaluations};
            }
        } else if (m_options.trace_limit > 0) {
            ++m_trace.left_out;
        }
        m_poses.erase(found);
        m_done.notify_all();
    }
    if (m_ledger.canDeliver()) // one that failed may be due, too
        m_done.notify_all();
}

// What the worker draws is drawn anew by others, into other memory: nobody knows what this one still writes.
void RendererService::Core::giveBack(Worker& worker, const std::exception_ptr& error)
{
    for (const Job& job : std::exchange(worker.jobs, {})) {
        if (!m_ledger.giveBack(job, error))
            continue;
        const auto found = m_poses.find(job.pose);
        if (found == m_poses.end())
            continue;
        auto fresh = std::make_shared<PoseWork>(*found->second);
        fresh->memory = nullptr;
        fresh->pictures = nullptr;
        fresh->again = true;
        for (PoseWork::Part& part : fresh->parts)
            part = {part.what, -1, 0, {}};
        found->second = std::move(fresh);
    }
    m_ledger.freeParts(worker.index);
    if (allGone())
        m_ledger.failWaiting(error);
    settle();
}

void RendererService::Core::note(TraceEvent::Kind kind, int worker, const std::string& cause)
{
    if (m_trace.events.size() < m_options.trace_limit)
        m_trace.events.push_back({now(), kind, worker, cause});
    else if (m_options.trace_limit > 0)
        ++m_trace.left_out;
}

void RendererService::Core::order(Worker& worker, Worker::Order order, const std::string& cause)
{
    if (worker.order == order)
        return;
    const bool works = order == Worker::Order::Work, worked = worker.order == Worker::Order::Work;
    worker.order = order;
    if (works) {
        ++worker.stats.starts;
        note(TraceEvent::Kind::Start, worker.index, cause);
    } else if (worked) {
        ++worker.stats.stops;
        note(TraceEvent::Kind::Stop, worker.index, cause);
        m_ledger.freeParts(worker.index);
    }
    m_work.notify_all();
}

double RendererService::Core::measuredRate() const
{
    if (m_span_ms <= 0)
        return 0;
    return (m_span_plan.mode == ServiceMode::Frame ? double(std::max<size_t>(working().size(), 1)) : 1.0) * 1000 /
           m_span_ms;
}

// What `rate` becomes with the frames to come.
double RendererService::Core::foreseen(double rate) const
{
    const double now_ms = m_cost.predict(now() - kAhead), then_ms = m_cost.predict(now() + kAhead);
    return now_ms > 0 && then_ms > 0 ? rate * now_ms / then_ms : 0;
}

// That workers start and stop by: a plan that is only being tried says little of what they can do.
double RendererService::Core::paceRate() const
{
    return m_choice.decided() ? measuredRate() : std::max(measuredRate(), m_choice.bestRate());
}

void RendererService::Core::lookAtPace()
{
    PaceFacts facts;
    WorkerPtr ready, last;
    for (const WorkerPtr& worker : m_workers) {
        if (worker->order == Worker::Order::Work) {
            const bool draws = worker->state == WorkerState::Working || worker->state == WorkerState::Warm;
            const bool loads = worker->state == WorkerState::Loading || worker->state == WorkerState::Cold;
            facts.working += draws || loads;
            facts.starting += loads;
            if (draws)
                last = worker;
            continue;
        }
        const bool can = worker->state == WorkerState::Warm || worker->state == WorkerState::Cold;
        facts.ready += can;
        if (can && (ready == nullptr || (ready->state != WorkerState::Warm && worker->state == WorkerState::Warm)))
            ready = worker;
    }
    facts.rate = paceRate();
    facts.predicted_rate = foreseen(facts.rate);
    const PaceDecision decision = m_pace.look(now(), facts);
    if (decision.step == PaceStep::Start && ready != nullptr)
        order(*ready, Worker::Order::Work, decision.cause);
    if (decision.step == PaceStep::Stop && last != nullptr)
        order(*last, m_options.keeps_warm ? Worker::Order::Hold : Worker::Order::Rest, decision.cause);
}

void RendererService::Core::lookForHangs()
{
    for (size_t i = 0; i < m_workers.size(); ++i) {
        const Worker& worker = *m_workers[i];
        const ServiceTime deadline =
            worker.state == WorkerState::Working ? m_options.deadline : m_options.load_deadline;
        if (worker.in_call && deadline.count() > 0 && now() - *worker.in_call > deadline)
            abandon(i, deadline);
    }
}

// When a worker that had a fault tries again. A machine that is slower than the deadline makes every part a fault: where
// `most_faults` lets a worker go on, nothing would be drawn for minutes without a longest pause.
ServiceTime RendererService::Core::returnOf(const Worker& worker) const
{
    constexpr uint32_t kMostDoublings = 6;
    return now() + m_options.comes_back * (1 << std::min(worker.faults_in_a_row - 1, kMostDoublings));
}

// A thread cannot be ended from outside: another worker takes the place of one that hangs.
void RendererService::Core::abandon(size_t index, ServiceTime deadline)
{
    const WorkerPtr hung = m_workers[index];
    hung->abandoned = true;
    const std::string text =
        formatString("hangs: %s took longer than %.0f ms",
                     hung->state == WorkerState::Working ? "a part" : "loading or letting go", milliseconds(deadline));
    const auto error = std::make_exception_ptr(
        Error(ErrorCode::Device, formatString("%s: %s, expected less; see whether the device still answers",
                                              deviceText(hung->device).c_str(), text.c_str())));
    m_error = error;
    auto fresh = std::make_shared<Worker>(hung->index, hung->device);
    fresh->order = hung->order;
    fresh->fault = error;
    fresh->stats = hung->stats;
    fresh->stats.last_fault = text;
    ++fresh->stats.faults;
    fresh->faults_in_a_row = hung->faults_in_a_row + 1;
    fresh->state = fresh->faults_in_a_row >= m_options.most_faults ? WorkerState::Gone : WorkerState::Retired;
    fresh->returns = returnOf(*fresh);
    m_workers[index] = fresh;
    m_abandoned.push_back(hung);
    note(TraceEvent::Kind::Retire, hung->index, text);
    giveBack(*hung, error);
    launch(fresh);
    if (allGone()) { // there is no thread for it
        m_ledger.failWaiting(m_error);
        settle();
    }
    m_work.notify_all();
    m_done.notify_all();
}

// Looks after workers, rates and waiting poses until the service stops.
void RendererService::Core::keep()
{
    Lock lock(m_mutex);
    while (!m_stopping) {
        m_kept.wait_for(lock, kLook);
        m_ledger.expire(now());
        settle();
        lookForHangs();
        lookAtPace();
        for (const WorkerPtr& worker : m_workers)
            if (worker->state == WorkerState::Retired && now() >= worker->returns)
                m_work.notify_all();
        std::erase_if(m_abandoned, [](const WorkerPtr& worker) {
            if (!worker->finished)
                return false;
            worker->thread.join();
            return true;
        });
    }
}

} // namespace gsc
