// SPDX-License-Identifier: Apache-2.0
// What callers ask of a service: start, submit, next, and the numbers.
#include "runtime/service/service_core.h"

#include <gsc/error.h>
#include "format/machine/threads.h"
#include "runtime/frame/frame_checks.h"

#include <algorithm>
#include <array>
#include <system_error>

namespace gsc {

namespace {

constexpr auto kHangsAtEnd = std::chrono::seconds(1); // that the end waits for a worker in a call

void checkServiceOptions(const ServiceOptions& options)
{
    if (options.devices.empty())
        throw Error(ErrorCode::Usage, "service: no device, expected at least one; name one");
    const PaceRules& pace = options.pace;
    if (!(pace.min_fps >= 0) || !(pace.max_fps >= 0) || (pace.max_fps > 0 && pace.max_fps < pace.min_fps))
        throw Error(ErrorCode::Usage,
                    formatString("service: from %g to %g frames per second, expected the first to be at "
                                 "most the second; correct them",
                                 pace.min_fps, pace.max_fps));
    if (options.keeps_all && options.timeout.count() > 0)
        throw Error(ErrorCode::Usage, "service: a timeout where all poses are kept, expected one or the other; leave "
                                      "one out");
}

} // namespace

RendererService::Core::Core(std::shared_ptr<const Scene> scene, const ModelView& model, const ServiceOptions& options)
    : m_options(options), m_scene(std::move(scene)), m_model(model),
      m_ledger({options.keeps_all, options.timeout, options.attempts}), m_pace(options.pace), m_rules(options.pace),
      m_choice(options.pace.min_fps)
{
    checkServiceOptions(options);
    for (size_t i = 0; i < options.devices.size(); ++i) {
        Worker& worker = *m_workers.emplace_back(std::make_shared<Worker>(int(i), options.devices[i]));
        worker.stats.device = worker.device;
    }
}

// A machine that gives no thread has one worker less.
void RendererService::Core::launch(const WorkerPtr& worker)
{
    const ThreadAttempt attempt;
    try {
        worker->thread = std::thread([self = shared_from_this(), worker] { self->run(worker); });
    } catch (const std::system_error& e) {
        worker->state = WorkerState::Gone;
        worker->stats.last_fault = formatString("no thread for it: %s", e.what());
        m_error = worker->fault = std::make_exception_ptr(tooFewThreads(deviceText(worker->device)));
    }
}

void RendererService::Core::start()
{
    if (!m_options.make)
        for (const WorkerPtr& worker : m_workers)
            checkDevice(worker->device);
    Lock lock(m_mutex);
    for (const WorkerPtr& worker : m_workers) {
        if (worker->index == 0 || m_rules.min_fps <= 0)
            order(*worker, Worker::Order::Work, "the service starts");
        else
            worker->order = m_options.keeps_warm ? Worker::Order::Hold : Worker::Order::Rest;
        launch(worker);
    }
    const auto settled = [this](Worker::Order least) {
        return std::ranges::all_of(m_workers, [&](const WorkerPtr& worker) {
            return worker->order < least ||
                   (worker->state != WorkerState::Cold && worker->state != WorkerState::Loading);
        });
    };
    const auto fail = [&](std::exception_ptr error) {
        lock.unlock();
        stop();
        std::rethrow_exception(error);
    };
    try {
        const ThreadAttempt attempt;
        m_keeper = std::thread([this] { keep(); }); // joined by stop(), before this ends
    } catch (const std::system_error&) {
        fail(std::make_exception_ptr(tooFewThreads("service")));
    }
    m_done.wait(lock, [&] { return settled(Worker::Order::Work); });
    for (const WorkerPtr& worker : m_workers) // a device that this build cannot use, or a mistake of the caller's
        if (worker->order == Worker::Order::Work && worker->state == WorkerState::Gone && worker->fault &&
            isOfRequest(worker->fault))
            fail(worker->fault);
    if (!m_facts) // what is to draw cannot: something else may
        m_done.wait(lock, [&] { return settled(Worker::Order::Hold); });
    for (const WorkerPtr& worker : m_workers) {
        if (m_facts)
            break;
        order(*worker, Worker::Order::Work, "the others cannot");
        m_done.wait(lock, [&] { return settled(Worker::Order::Work); });
    }
    if (!m_facts)
        fail(m_error);
}

void RendererService::Core::stop()
{
    Lock lock(m_mutex);
    m_stopping = true;
    m_work.notify_all();
    m_kept.notify_all();
    lock.unlock();
    if (m_keeper.joinable())
        m_keeper.join();
    lock.lock();
    std::vector<WorkerPtr> all = m_workers;
    all.insert(all.end(), m_abandoned.begin(), m_abandoned.end());
    const auto until = std::chrono::steady_clock::now() + kHangsAtEnd;
    for (const WorkerPtr& worker : all) {
        // one that draws is waited for, for as long as it does not hang
        const auto ends = [&] { return worker->finished || !worker->thread.joinable(); };
        const ServiceTime deadline = // a device that does not let go must not hold up the end for minutes
            worker->state == WorkerState::Loading ? m_options.load_deadline : m_options.deadline;
        if (worker->abandoned)
            m_done.wait_until(lock, until, ends);
        else if (deadline.count() > 0)
            m_done.wait_for(lock, std::max<std::chrono::nanoseconds>(deadline, kHangsAtEnd), ends);
        else
            m_done.wait(lock, ends);
        if (!worker->thread.joinable())
            continue;
        const bool ended = worker->finished;
        lock.unlock();
        ended ? worker->thread.join() : worker->thread.detach(); // it holds what it uses
        lock.lock();
    }
}

bool RendererService::Core::isStill(const PoseWork& work) const
{
    if (work.late != nullptr) // nobody knows yet where its eyes are
        return false;
    if (m_last == nullptr || (m_options.still_distance <= 0 && m_options.still_degrees <= 0))
        return false;
    const bool shows = m_ledger.isOpen(m_last_pose) || (m_last_end == PoseEnd::Shown && !m_last_partial);
    return shows && work.showsSameAs(*m_last, m_options.still_distance, m_options.still_degrees);
}

uint64_t RendererService::Core::submit(const PoseRequest& request)
{
    checkRequest(m_model, {request.eyes, {}, request.options}, true);
    if (!request.options.columns.all())
        throw Error(ErrorCode::Usage,
                    "service: a pose with columns of its own, expected none; leave them out, the service "
                    "chooses bands itself");
    if (request.options.lod_hysteresis > 0 && m_options.devices.size() > 1)
        throw Error(ErrorCode::Unsupported,
                    "service: LOD hysteresis with several workers, of which each sees only some "
                    "of the poses, expected 0; leave it out or use one worker");
    if (m_options.mode == ServiceMode::Eye && decodesMerged(request.options, uint32_t(request.eyes.size())))
        throw Error(ErrorCode::Usage,
                    "service: mode eye together with stereo merged, which decodes once for both eyes, "
                    "expected one of them; use mode split or frame");
    auto work = std::make_shared<PoseWork>();
    std::ranges::copy(request.eyes, work->eyes);
    work->eye_count = uint32_t(request.eyes.size());
    work->options = request.options;
    work->format = request.format;
    work->wants_depth = request.wants_depth;
    work->on_device = request.on_device;
    if (request.late) {
        work->late = std::make_shared<PoseWork::Late>();
        work->late->look = request.late;
    }
    work->layOut();

    const Lock lock(m_mutex);
    if (isStill(*work)) {
        ++m_still;
        return m_last_pose;
    }
    work->submitted = now();
    const uint64_t pose = m_ledger.add(work->submitted);
    m_poses.emplace(pose, work);
    m_last = work;
    m_last_pose = pose;
    if (allGone()) {
        m_ledger.failWaiting(m_error);
        settle();
    }
    m_work.notify_all();
    return pose;
}

std::optional<Delivery> RendererService::Core::next(std::chrono::nanoseconds most)
{
    Lock lock(m_mutex);
    const bool for_ever = most > std::chrono::hours(24 * 365);
    const auto until = std::chrono::steady_clock::now() + (for_ever ? std::chrono::nanoseconds(0) : most);
    for (;;) {
        if (const std::optional<EndedPose> ended = m_ledger.deliver()) {
            Delivery delivery;
            delivery.pose = ended->pose;
            delivery.end = ended->end;
            delivery.error = ended->error;
            const std::shared_ptr<PoseWork> work = m_poses.at(ended->pose);
            delivery.submitted = work->submitted;
            delivery.begun = work->begun.value_or(work->submitted);
            delivery.drawn = work->drawn;
            delivery.delivered = now();
            if (ended->end == PoseEnd::Shown) {
                for (uint32_t e = 0; e < work->eye_count; ++e)
                    delivery.eyes[e] = work->target(e, work->pictures->kind(), work->memory.get());
                delivery.memory = work->memory;
                delivery.result = work->result();
                m_latency.add(milliseconds(delivery.delivered - delivery.submitted));
            }
            settle();
            return delivery;
        }
        if (m_poses.empty() || m_stopping)
            return std::nullopt;
        if (for_ever)
            m_done.wait(lock);
        else if (m_done.wait_until(lock, until) == std::cv_status::timeout &&
                 std::chrono::steady_clock::now() >= until && !m_ledger.canDeliver())
            return std::nullopt;
    }
}

void RendererService::Core::giveMemoryBack()
{
    Lock lock(m_mutex);
    for (const WorkerPtr& worker : m_workers)
        if (worker->order == Worker::Order::Hold)
            order(*worker, Worker::Order::Rest, "memory is given back");
    const auto pictures = std::to_array(m_pictures);
    lock.unlock();
    for (const std::shared_ptr<PictureMemory>& own : pictures)
        if (own != nullptr)
            own->trim();
}

void RendererService::Core::setPace(double min_fps, double max_fps)
{
    const Lock lock(m_mutex);
    ServiceOptions options = m_options;
    options.pace.min_fps = min_fps;
    options.pace.max_fps = max_fps;
    checkServiceOptions(options);
    m_rules = options.pace;
    m_pace = Pace(m_rules);
    m_choice.want(min_fps);
    for (const WorkerPtr& worker : m_workers)
        if (m_rules.min_fps <= 0)
            order(*worker, Worker::Order::Work, "no rate is asked for");
}

void RendererService::Core::dropCaches()
{
    Lock lock(m_mutex);
    const uint64_t drops = ++m_drops;
    m_work.notify_all();
    m_done.wait(lock, [&] {
        return m_stopping || std::ranges::all_of(m_workers, [&](const WorkerPtr& worker) {
                   return worker->dropped >= drops ||
                          (worker->state != WorkerState::Warm && worker->state != WorkerState::Working);
               });
    });
}

ServiceStats RendererService::Core::stats() const
{
    const Lock lock(m_mutex);
    ServiceStats stats;
    stats.counts = m_ledger.counts();
    stats.still = m_still;
    stats.latency = m_latency.stats();
    stats.rate = measuredRate();
    stats.predicted_rate = foreseen(stats.rate);
    const std::vector<int> all = working();
    stats.plan =
        m_options.mode == ServiceMode::Auto ? m_choice.plan() : SharePlan{m_options.mode, uint32_t(all.size())};
    stats.plan_cause = m_options.mode == ServiceMode::Auto && !m_choice.decided()
                           ? "not decided yet, all modes are still tried in turn"
                           : m_choice.cause();
    stats.working = uint32_t(all.size());
    for (const WorkerPtr& worker : m_workers) {
        stats.workers.push_back(worker->stats);
        stats.workers.back().state = worker->state;
    }
    return stats;
}

ServiceTrace RendererService::Core::trace() const
{
    const Lock lock(m_mutex);
    return m_trace;
}

DeviceFacts RendererService::Core::device() const
{
    const Lock lock(m_mutex);
    return *m_facts;
}

Tier RendererService::Core::tierOf(Tier asked) const
{
    const Lock lock(m_mutex);
    return asked == Tier::Exact ? m_tier_exact : m_tier_fast;
}

RendererService::RendererService(std::shared_ptr<const Scene> scene, const ServiceOptions& options)
{
    const ModelView view = scene->view();
    m_core = std::make_shared<Core>(std::move(scene), view, options);
    m_core->start();
}

RendererService::RendererService(const ModelView& model, const ServiceOptions& options)
    : m_core(std::make_shared<Core>(nullptr, model, options))
{
    m_core->start();
}

RendererService::~RendererService()
{
    m_core->stop();
}

uint64_t RendererService::submit(const PoseRequest& request)
{
    return m_core->submit(request);
}

std::optional<Delivery> RendererService::next(std::chrono::nanoseconds most)
{
    return m_core->next(most);
}

void RendererService::giveMemoryBack()
{
    m_core->giveMemoryBack();
}

void RendererService::setPace(double min_fps, double max_fps)
{
    m_core->setPace(min_fps, max_fps);
}

void RendererService::dropCaches()
{
    m_core->dropCaches();
}

ServiceStats RendererService::stats() const
{
    return m_core->stats();
}

ServiceTrace RendererService::trace() const
{
    return m_core->trace();
}

ServiceTime RendererService::now() const
{
    return m_core->now();
}

DeviceFacts RendererService::device() const
{
    return m_core->device();
}

Tier RendererService::tierOf(Tier asked) const
{
    return m_core->tierOf(asked);
}

} // namespace gsc
