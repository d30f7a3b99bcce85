// SPDX-License-Identifier: Apache-2.0
// A worker's thread: makes its renderer, takes parts, draws them, brings them to where pictures are delivered.
#include "runtime/service/service_core.h"

#include <gsc/error.h>
#include "kernels/threads/stopwatch.h"

#include <algorithm>

namespace gsc {

namespace {

constexpr uint32_t kFirstParts = 3; // of a renderer, which tell nothing of its speed

} // namespace

bool isOfRequest(const std::exception_ptr& error)
{
    try {
        std::rethrow_exception(error);
    } catch (const Error& e) {
        return e.code() == ErrorCode::Usage || e.code() == ErrorCode::Unsupported;
    } catch (...) {
        return false;
    }
}

// Runs `call`, which uses the renderer, outside of the mutex. A call that takes too long is what lookForHangs() looks for.
template <typename Call>
auto RendererService::Core::calling(Worker& worker, Lock& lock, const Call& call)
{
    struct Outside {
        Worker& worker;
        Lock& lock;
        Outside(Worker& w, Lock& l, ServiceTime now) : worker(w), lock(l)
        {
            worker.in_call = now;
            lock.unlock();
        }
        ~Outside()
        {
            lock.lock();
            worker.in_call.reset();
        }
    } outside(worker, lock, now());
    return call();
}

void RendererService::Core::run(const WorkerPtr& worker)
{
    std::deque<PartInFlight> flying;
    Lock lock(m_mutex);
    while (!m_stopping && !worker->abandoned) {
        try {
            if (!serve(worker, lock, flying))
                m_work.wait(lock);
        } catch (...) {
            const std::exception_ptr error = std::current_exception();
            if (!worker->abandoned)
                retire(worker, error);
            forgetLost(*worker, lock);
            calling(*worker, lock, [&] {
                worker->bridge.reset();
                worker->bridge_to.reset();
                worker->renderer.reset();
                flying.clear(); // its pictures, which a frame in flight is drawn into until the renderer goes
            });
        }
    }
    // the renderer is to end what it draws before the pictures that it draws into go
    lock.unlock();
    worker->bridge.reset();
    worker->renderer.reset();
    flying.clear();
    lock.lock();
    worker->finished = true;
    m_done.notify_all();
}

// One step. False: there is nothing to do until something changes.
bool RendererService::Core::serve(const WorkerPtr& worker, Lock& lock, std::deque<PartInFlight>& flying)
{
    Worker& w = *worker;
    if (w.state == WorkerState::Gone)
        return false;
    if (w.state == WorkerState::Retired) {
        if (now() < w.returns)
            return false; // the keeper wakes it
        note(TraceEvent::Kind::Return, w.index, "after a fault");
        w.state = WorkerState::Cold;
    }
    if (flying.empty()) {
        if (w.order == Worker::Order::Rest) {
            if (w.renderer != nullptr)
                calling(w, lock, [&] {
                    w.bridge.reset();
                    w.bridge_to.reset();
                    w.renderer.reset();
                });
            w.state = WorkerState::Cold;
            m_done.notify_all();
            return w.order != Worker::Order::Rest;
        }
        if (w.renderer == nullptr) {
            makeReady(worker, lock);
            return true;
        }
        w.state = w.order == Worker::Order::Work ? WorkerState::Working : WorkerState::Warm;
        if (w.dropped != m_drops) {
            const uint64_t drops = m_drops;
            calling(w, lock, [&] { w.renderer->dropCaches(); });
            w.dropped = drops;
            m_done.notify_all();
        }
    }
    if (w.order == Worker::Order::Work && flying.size() < partsAhead() && beginPart(w, lock, flying))
        return true;
    if (flying.empty())
        return false;
    endPart(w, lock, flying);
    return true;
}

void RendererService::Core::makeReady(const WorkerPtr& worker, Lock& lock)
{
    Worker& w = *worker;
    w.state = WorkerState::Loading;
    const ServiceTime from = now();
    const uint64_t drops = m_drops;
    DeviceFacts facts;
    calling(w, lock, [&] {
        w.renderer =
            m_options.make ? m_options.make(w.device, m_options.renderer) : makeRenderer(w.device, m_options.renderer);
        m_scene != nullptr ? w.renderer->load(m_scene) : w.renderer->load(m_model);
        facts = w.renderer->device();
    });
    if (w.abandoned)
        return;
    makePictures(w);
    if (!m_facts) {
        m_facts = facts;
        m_tier_exact = w.renderer->tierOf(Tier::Exact);
        m_tier_fast = w.renderer->tierOf(Tier::Fast);
    }
    w.stats.device = w.renderer->id();
    w.stats.name = facts.name;
    w.stats.load_ms = milliseconds(now() - from);
    w.drawn = 0;
    w.dropped = drops;
    w.state = WorkerState::Warm;
    note(TraceEvent::Kind::Ready, w.index, formatString("loaded in %.0f ms", w.stats.load_ms));
    m_done.notify_all();
    m_kept.notify_all();
}

void RendererService::Core::makePictures(const Worker& w)
{
    if (m_pictures[0] != nullptr)
        return;
    const bool locked = std::ranges::any_of(m_options.devices,
                                            [](const DeviceId& device) { return !device.backend.starts_with("cpu"); });
    const DeviceId& first = m_options.devices.front();
    m_pictures[0] = hostPictures(locked);
    m_pictures[1] = devicePictures(first.backend == "auto" ? w.renderer->id() : first);
}

// Outside of the mutex: a driver may take its time. A device that is lost or full gives no memory for pictures: then they
// are delivered on that of a worker that goes on.
void RendererService::Core::takeMemory(Worker& w, Lock& lock, PoseWork& work)
{
    std::shared_ptr<PictureMemory> pictures = m_pictures[work.on_device];
    std::shared_ptr<std::byte> memory;
    bool moved = false;
    calling(w, lock, [&] {
        try {
            memory = pictures->take(work.bytes);
        } catch (const Error& e) {
            const bool is_theirs = e.code() == ErrorCode::Device || e.code() == ErrorCode::OutOfMemory;
            if (!work.on_device || !is_theirs || pictures->takesFrom(*w.renderer))
                throw;
            pictures = devicePictures(w.renderer->id());
            memory = pictures->take(work.bytes);
            moved = true;
        }
    });
    if (moved)
        m_pictures[1] = pictures;
    if (work.memory == nullptr) { // another worker may have been faster
        work.memory = memory;
        work.pictures = pictures;
    }
}

// Before the renderer goes, which resets a device that is lost: then memory of its pictures is of no use.
void RendererService::Core::forgetLost(Worker& w, Lock& lock)
{
    const std::shared_ptr<PictureMemory> pictures = m_pictures[1];
    if (pictures == nullptr || !calling(w, lock, [&] { return pictures->lost(); }) || m_pictures[1] != pictures)
        return;
    const DeviceId& first = m_options.devices.front();
    m_pictures[1] = devicePictures(first.backend == "auto" ? w.stats.device : first);
}

// In a handler: the pose of `job` fails where no worker could draw it, otherwise the fault is the worker's and goes on.
void RendererService::Core::failRequest(Worker& w, const Job& job)
{
    const std::exception_ptr error = std::current_exception();
    if (!isOfRequest(error))
        throw;
    std::erase(w.jobs, job);
    m_ledger.fail(job, error);
    settle();
    m_work.notify_all();
}

// Takes a part and submits it. False: there is none.
bool RendererService::Core::beginPart(Worker& w, Lock& lock, std::deque<PartInFlight>& flying)
{
    const std::optional<Job> job = take(w, flying.size());
    if (!job)
        return false;
    w.jobs.push_back(*job);
    PartInFlight& part = flying.emplace_back();
    part.job = *job;
    part.work = m_poses.at(job->pose);
    part.part = m_ledger.part(*job);
    part.since = now();
    part.slot = flying.size() > 1 && flying.front().slot == 0 ? 1 : 0;
    try {
        if (part.work->memory == nullptr)
            takeMemory(w, lock, *part.work);
        part.bridged = !part.work->pictures->takesFrom(*w.renderer);
        // a bridge to a device that was lost would keep it from beginning anew
        const bool stale = w.bridge_to != m_pictures[0] && w.bridge_to != m_pictures[1];
        calling(w, lock, [&] {
            prepare(w, part, stale);
            part.ticket = w.renderer->submit(part.request());
        });
    } catch (...) {
        failRequest(w, part.job);
        flying.pop_back();
    }
    return true;
}

// What the renderer is asked for.
void RendererService::Core::prepare(Worker& w, PartInFlight& part, bool stale)
{
    const PoseWork& work = *part.work;
    FrameTarget buffer{};
    buffer.kind = work.pictures->kind();
    buffer.pixels = work.memory.get();
    if (stale || (part.bridged && w.bridge_to != work.pictures)) {
        w.bridge = nullptr;
        w.bridge_to = nullptr;
    }
    if (part.bridged && w.bridge == nullptr) {
        w.bridge = bridgeTo(*work.pictures, *w.renderer);
        w.bridge_to = work.pictures;
    }
    if (part.bridged) {
        part.bridge = w.bridge;
        buffer = part.bridge->buffer(part.slot, work.bytes);
    }
    part.options = work.options;
    part.options.columns = part.part.columns;
    const std::span<const EyeParams> eyes = work.latestEyes();
    for (uint32_t e = 0; e < work.eye_count; ++e)
        if (part.part.eyes >> e & 1) {
            std::ranges::copy(work.options.foveation.gaze[e], part.options.foveation.gaze[part.eyes.size()]);
            part.options.lens[part.eyes.size()] = work.options.lens[e];
            part.eyes.push_back(eyes[e]);
            part.targets.push_back(work.target(e, buffer.kind, static_cast<std::byte*>(buffer.pixels)));
        }
}

// Waits for the oldest part and brings it home.
void RendererService::Core::endPart(Worker& w, Lock& lock, std::deque<PartInFlight>& flying)
{
    PartInFlight& part = flying.front();
    FrameResult result;
    try {
        calling(w, lock, [&] {
            result = finish(*w.renderer, part.request(), part.ticket);
            if (part.bridged)
                land(part);
        });
    } catch (...) {
        failRequest(w, part.job);
        flying.pop_front();
        return;
    }
    const PartInFlight ended = std::move(part);
    flying.pop_front();
    std::erase(w.jobs, ended.job);
    if (w.abandoned || !m_ledger.isDrawing(ended.job))
        return;
    const ServiceTime at = now();
    PoseWork::Part& drawn = ended.work->parts[ended.job.part];
    drawn.worker = w.index;
    drawn.busy_ms = milliseconds(at - std::max(ended.since, w.busy_until));
    drawn.result = result;
    w.busy_until = at;
    ended.work->first = ended.work->first || w.drawn < kFirstParts;
    ++w.drawn;
    ++w.stats.parts;
    w.faults_in_a_row = 0;
    w.stats.busy_ms += drawn.busy_ms;
    m_ledger.drawn(ended.job);
    noteDrawn(ended.job.pose, ended.work);
}

void RendererService::Core::land(const PartInFlight& part)
{
    const PoseWork& work = *part.work;
    for (uint32_t e = 0; e < work.eye_count; ++e) {
        if (!(part.part.eyes >> e & 1))
            continue;
        const EyeParams& eye = work.eyes[e];
        const ColumnRange columns = part.part.columns.within(eye.width);
        const auto bring = [&](size_t at, size_t pixel) {
            part.bridge->land(
                part.slot, work.memory.get(),
                {at + columns.first * pixel, eye.width * pixel, (columns.end - columns.first) * pixel, eye.height});
        };
        bring(work.pixels_at[e], pixelBytes(work.format));
        if (work.wants_depth)
            bring(work.depths_at[e], sizeof(float));
    }
    part.bridge->finish();
}

// Its parts go back to the queue. Called with the mutex held.
void RendererService::Core::retire(const WorkerPtr& worker, const std::exception_ptr& error)
{
    Worker& w = *worker;
    m_error = w.fault = error;
    ++w.stats.faults;
    bool lasting = ++w.faults_in_a_row >= m_options.most_faults;
    try {
        std::rethrow_exception(error);
    } catch (const Error& e) {
        w.stats.last_fault = e.what();
        lasting = lasting || e.code() == ErrorCode::Usage || e.code() == ErrorCode::Unsupported;
    } catch (const std::exception& e) {
        w.stats.last_fault = e.what();
    } catch (...) {
        w.stats.last_fault = "an unknown exception";
    }
    w.state = lasting ? WorkerState::Gone : WorkerState::Retired;
    w.returns = returnOf(w);
    note(TraceEvent::Kind::Retire, w.index, w.stats.last_fault);
    giveBack(w, error);
    m_work.notify_all();
    m_done.notify_all();
    m_kept.notify_all();
}

} // namespace gsc
