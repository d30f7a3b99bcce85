// SPDX-License-Identifier: Apache-2.0
// Functions of a service that its callers use: start and stop, submit, next, and the numbers.
#include "runtime/service/renderer_service.h"

#include <gsc/error.h>
#include "format/machine/threads.h"
#include "runtime/backend/frame_checks.h"
#include "runtime/service/keeper.h"
#include "runtime/service/worker_retirement.h"
#include "runtime/service/worker_thread.h"

#include <algorithm>
#include <system_error>

namespace gsc {

namespace {

using Lock = std::unique_lock<std::mutex>;

constexpr auto kHangsAtEnd = std::chrono::seconds(1); // time that the end waits for a worker that hangs in a call

void checkServiceOptions(const ServiceOptions& options)
{
    if (options.devices.empty())
        throw Error(ErrorCode::Usage, "service", "no device", "at least one", "name one");
    const PaceRules& pace = options.pace;
    if (!(pace.min_fps >= 0) || !(pace.max_fps >= 0) || (pace.max_fps > 0 && pace.max_fps < pace.min_fps))
        throw Error(ErrorCode::Usage, "service",
                    formatString("from %g to %g frames per second", pace.min_fps, pace.max_fps),
                    "the first to be at most the second", "correct them");
    if (options.keeps_all && options.timeout.count() > 0)
        throw Error(ErrorCode::Usage, "service", "a timeout where all poses are kept", "one or the other",
                    "leave one out");
}

void checkPose(const ModelView& model, const ServiceOptions& service, const PoseRequest& request)
{
    checkRequest(model, {request.eyes, {}, request.options}, true);
    for (const DeviceId& device : service.devices)
        checkReuse(device.backend, request.options.reuse.policy);
    if (!request.options.columns.all())
        throw Error(ErrorCode::Usage, "service", "a pose with columns of its own", "none",
                    "leave them out, the service chooses bands itself");
    if (request.options.lod_hysteresis > 0 && service.devices.size() > 1)
        throw Error(ErrorCode::Unsupported, "service",
                    "LOD hysteresis with several workers, of which each sees only some of the poses", "0",
                    "leave it out or use one worker");
    if (service.mode == ServiceMode::Eye && decodesMerged(request.options, uint32_t(request.eyes.size())))
        throw Error(ErrorCode::Usage, "service",
                    "mode eye together with stereo merged, which decodes once for both eyes", "one of them",
                    "use mode split or frame");
}

} // namespace

RendererService::RendererService(std::shared_ptr<const Scene> scene, const ServiceOptions& options)
    : RendererService(scene, scene->view(), options)
{
}

RendererService::RendererService(const ModelView& model, const ServiceOptions& options)
    : RendererService(nullptr, model, options)
{
}

RendererService::RendererService(std::shared_ptr<const Scene> scene, const ModelView& model,
                                 const ServiceOptions& options)
{
    checkServiceOptions(options);
    m_state = std::make_shared<ServiceState>(std::move(scene), model, options);
    try {
        start();
    } catch (...) {
        stop();
        throw;
    }
}

RendererService::~RendererService()
{
    stop();
}

void RendererService::start()
{
    ServiceState& state = *m_state;
    const std::vector<WorkerPtr> workers = state.workers.all();
    if (!state.options.make)
        for (const WorkerPtr& worker : workers)
            checkDevice(worker->device);
    Lock lock(state.mutex);
    for (const WorkerPtr& worker : workers) {
        if (worker->index == 0 || state.options.pace.min_fps <= 0)
            state.workers.order(*worker, true, "the service starts");
        launch(m_state, worker);
    }
    try {
        const ThreadAttempt attempt;
        m_keeper = startKeeper(m_state);
    } catch (const std::system_error&) {
        throw tooFewThreads("service");
    }
    const auto settle = [&](bool also_who_rests) {
        state.caller_wakes.wait(lock, [&] {
            return std::ranges::none_of(state.workers.all(), [&](const WorkerPtr& worker) {
                return (worker->draws || also_who_rests) && worker->loads();
            });
        });
    };
    settle(false);
    for (const WorkerPtr& worker : state.workers.all()) // the build cannot use the device, or the caller made a mistake
        if (worker->draws && worker->state == WorkerState::Gone && worker->fault && isOfRequest(worker->fault))
            std::rethrow_exception(worker->fault);
    if (!state.first) // the workers that should draw have failed, so others are tried
        settle(true);
    for (size_t i = 0; i < workers.size() && !state.first; ++i) {
        state.workers.order(*state.workers.all()[i], true, "the others cannot");
        settle(false);
    }
    if (!state.first)
        std::rethrow_exception(state.error);
}

void RendererService::stop()
{
    ServiceState& state = *m_state;
    Lock lock(state.mutex);
    state.stopping = true;
    state.worker_wakes.notify_all();
    state.keeper_wakes.notify_all();
    lock.unlock();
    if (m_keeper.joinable())
        m_keeper.join();
    lock.lock();
    const auto until = std::chrono::steady_clock::now() + kHangsAtEnd;
    for (const WorkerPtr& worker : state.workers.withAbandoned()) {
        const auto ends = [&] { return worker->finished || !worker->thread.joinable(); };
        const ServiceTime deadline = // a device that does not free its memory must not delay the end by minutes
            worker->state == WorkerState::Loading ? state.options.load_deadline : state.options.deadline;
        if (worker->abandoned)
            state.caller_wakes.wait_until(lock, until, ends);
        else if (deadline.count() > 0)
            state.caller_wakes.wait_for(lock, std::max<std::chrono::nanoseconds>(deadline, kHangsAtEnd), ends);
        else
            state.caller_wakes.wait(lock, ends);
        if (!worker->thread.joinable())
            continue;
        const bool ended = worker->finished;
        lock.unlock();
        ended ? worker->thread.join() : worker->thread.detach(); // a detached thread owns everything that it uses
        lock.lock();
    }
}

uint64_t RendererService::submit(const PoseRequest& request)
{
    ServiceState& state = *m_state;
    checkPose(state.model, state.options, request);
    const auto work = std::make_shared<PoseWork>(request);
    const Lock lock(state.mutex);
    const uint64_t pose = state.poses.add(work);
    if (state.workers.allGone())
        state.poses.failWaiting(state.error);
    state.worker_wakes.notify_all();
    return pose;
}

std::optional<Delivery> RendererService::next(std::chrono::nanoseconds most)
{
    ServiceState& state = *m_state;
    Lock lock(state.mutex);
    const bool for_ever = most > std::chrono::hours(24 * 365);
    const auto until = std::chrono::steady_clock::now() + (for_ever ? std::chrono::nanoseconds(0) : most);
    for (;;) {
        if (std::optional<Delivery> delivery = state.poses.deliver())
            return delivery;
        if (state.poses.empty() || state.stopping)
            return std::nullopt;
        if (for_ever)
            state.caller_wakes.wait(lock);
        else if (state.caller_wakes.wait_until(lock, until) == std::cv_status::timeout &&
                 std::chrono::steady_clock::now() >= until && !state.poses.canDeliver())
            return std::nullopt;
    }
}

void RendererService::dropCaches()
{
    ServiceState& state = *m_state;
    Lock lock(state.mutex);
    const uint64_t drops = ++state.drops;
    state.worker_wakes.notify_all();
    state.caller_wakes.wait(lock, [&] {
        return state.stopping || std::ranges::all_of(state.workers.all(), [&](const WorkerPtr& worker) {
                   return worker->dropped >= drops || !worker->isReady();
               });
    });
}

ServiceStats RendererService::stats() const
{
    const Lock lock(m_state->mutex);
    ServiceStats stats;
    m_state->poses.fill(stats);
    m_state->workers.fill(stats);
    m_state->sharing.fill(stats);
    return stats;
}

ServiceTrace RendererService::trace() const
{
    const Lock lock(m_state->mutex);
    return m_state->trace.trace();
}

ServiceTime RendererService::now() const
{
    return m_state->clock.now();
}

DeviceFacts RendererService::device() const
{
    const Lock lock(m_state->mutex);
    return m_state->first->device;
}

Tier RendererService::tierOf(Tier asked) const
{
    const Lock lock(m_state->mutex);
    return asked == Tier::Exact ? m_state->first->exact : m_state->first->fast;
}

} // namespace gsc
