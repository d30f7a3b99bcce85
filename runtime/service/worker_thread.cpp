// SPDX-License-Identifier: Apache-2.0
#include "runtime/service/worker_thread.h"

#include <gsc/error.h>
#include "format/machine/threads.h"
#include "kernels/threads/stopwatch.h"
#include "runtime/service/worker_retirement.h"

#include <algorithm>
#include <system_error>

namespace gsc {

namespace {

// Number of the first parts of a renderer whose times do not count, because buffers grow; with detail more, because
// coarse copies are made.
constexpr uint32_t kFirstParts = 3, kFirstCoarseParts = 16;

// The thread of a worker. Only the thread itself uses the members. The service's mutex is held except in calling().
class WorkerThread {
public:
    WorkerThread(std::shared_ptr<ServiceState> service, WorkerPtr worker)
        : m_service(std::move(service)), m_worker(std::move(worker)), m_lock(m_service->mutex)
    {
    }

    void run()
    {
        while (!m_service->stopping && !m_worker->abandoned) {
            try {
                if (!serve())
                    m_service->worker_wakes.wait(m_lock);
            } catch (...) {
                if (!m_worker->abandoned)
                    retire(*m_service, *m_worker, std::current_exception());
                forgetLost();
                calling([&] { letGo(); });
            }
        }
        m_lock.unlock();
        letGo();
        m_lock.lock();
        m_worker->finished = true;
        m_service->caller_wakes.notify_all();
    }

private:
    // A part that the renderer is drawing.
    struct PartInFlight {
        Job job;
        std::shared_ptr<PoseWork> work;
        PosePart what;
        uint32_t slot = 0; // slot of PictureBridge that the part uses
        // copies the picture to the memory of delivery; null: the renderer draws there itself
        std::shared_ptr<PictureBridge> bridge;
        std::vector<EyeParams> eyes;
        std::vector<FrameTarget> targets;
        FrameOptions options;
        uint64_t ticket = 0;
        ServiceTime since{0}; // time when the part was taken

        [[nodiscard]] FrameRequest request() const { return {eyes, targets, options}; }
    };

    // Runs `call`, which uses the renderer, without the mutex. replaceHanging() finds calls that take too long.
    template <typename Call>
    auto calling(const Call& call) -> decltype(call())
    {
        struct Outside {
            WorkerThread& thread;
            explicit Outside(WorkerThread& of) : thread(of)
            {
                thread.m_worker->in_call = thread.m_service->clock.now();
                thread.m_lock.unlock();
            }
            ~Outside()
            {
                thread.m_lock.lock();
                thread.m_worker->in_call.reset();
            }
        } outside(*this);
        return call();
    }

    // Takes one step. Returns false if there is nothing to do until something changes.
    bool serve()
    {
        Worker& worker = *m_worker;
        if (worker.isOut() && !comesBack(*m_service, worker))
            return false;
        if (m_flying.empty()) {
            if (m_renderer == nullptr) {
                makeReady();
                return true;
            }
            worker.state = worker.draws ? WorkerState::Working : WorkerState::Warm;
            if (worker.dropped != m_service->drops)
                followDrops();
        }
        if (worker.draws && m_flying.size() < m_service->sharing.partsAhead() && beginPart())
            return true;
        if (m_flying.empty())
            return false;
        endPart();
        return true;
    }

    void makeReady()
    {
        Worker& worker = *m_worker;
        worker.state = WorkerState::Loading;
        const ServiceTime from = m_service->clock.now();
        const uint64_t drops = m_service->drops;
        DeviceFacts facts;
        calling([&] {
            const ServiceState& service = *m_service;
            RendererOptions options = service.options.renderer;
            options.coarse_unlimited = service.options.devices.size() > 1;
            m_renderer = service.options.make ? service.options.make(worker.device, options)
                                              : makeRenderer(worker.device, options);
            service.scene != nullptr ? m_renderer->load(service.scene) : m_renderer->load(service.model);
            facts = m_renderer->device();
        });
        if (worker.abandoned)
            return;
        if (!m_service->first) {
            m_service->pictures.make(m_service->options.devices, m_renderer->id());
            m_service->first = {facts, m_renderer->tierOf(Tier::Exact), m_renderer->tierOf(Tier::Fast)};
        }
        worker.stats.device = m_renderer->id();
        worker.stats.name = facts.name;
        worker.stats.load_ms = milliseconds(m_service->clock.now() - from);
        worker.dropped = drops;
        worker.state = WorkerState::Warm;
        m_drawn = 0;
        m_service->trace.note(TraceEvent::Kind::Ready, worker.index,
                              formatString("loaded in %.0f ms", worker.stats.load_ms));
        m_service->caller_wakes.notify_all();
        m_service->keeper_wakes.notify_all();
    }

    void followDrops()
    {
        const uint64_t drops = m_service->drops;
        calling([&] { m_renderer->dropCaches(); });
        m_worker->dropped = drops;
        m_coarse = false;
        m_service->caller_wakes.notify_all();
    }

    // Takes a part and submits it to the renderer. Returns false if there is none.
    bool beginPart()
    {
        const std::optional<Job> job = m_service->sharing.take(*m_worker, m_flying.size());
        if (!job)
            return false;
        m_worker->jobs.push_back(*job);
        PartInFlight& part = m_flying.emplace_back();
        part.job = *job;
        part.work = m_service->poses.work(job->pose);
        part.what = part.work->parts[job->part].what;
        part.since = m_service->clock.now();
        part.slot = m_flying.size() > 1 && m_flying.front().slot == 0 ? 1 : 0;
        try {
            if (part.work->memory == nullptr)
                takeMemory(*part.work);
            const bool old_bridge = m_bridge != nullptr && m_service->pictures.isOld(m_bridge_to);
            calling([&] {
                prepare(part, old_bridge);
                part.ticket = m_renderer->submit(part.request());
            });
        } catch (...) {
            failRequest(part.job);
            m_flying.pop_back();
        }
        return true;
    }

    void takeMemory(PoseWork& work)
    {
        const DeliveryMemory::Pictures from = m_service->pictures.of(work.asked.on_device);
        const DeliveryMemory::Taken taken = calling([&] { return DeliveryMemory::take(work, from, *m_renderer); });
        if (taken.pictures != from)
            m_service->pictures.moveTo(taken.pictures);
        if (work.memory == nullptr) { // set only if no other worker has set it meanwhile
            work.memory = taken.memory;
            work.pictures = taken.pictures;
        }
    }

    // Sets the options, eyes and targets of the part for the renderer.
    void prepare(PartInFlight& part, bool old_bridge)
    {
        const PoseWork& work = *part.work;
        const bool bridged = !work.pictures->takesFrom(*m_renderer);
        if (old_bridge || (bridged && m_bridge_to != work.pictures)) {
            m_bridge = nullptr;
            m_bridge_to = nullptr;
        }
        FrameTarget buffer{};
        buffer.kind = work.pictures->kind();
        buffer.pixels = work.memory.get();
        if (bridged) {
            if (m_bridge == nullptr) {
                m_bridge = bridgeTo(*work.pictures, *m_renderer);
                m_bridge_to = work.pictures;
            }
            part.bridge = m_bridge;
            buffer = part.bridge->buffer(part.slot, work.bytes);
        }
        part.options = work.asked.options;
        part.options.columns = part.what.columns;
        const std::span<const EyeParams> eyes = work.latestEyes();
        for (uint32_t e = 0; e < work.eyeCount(); ++e)
            if (part.what.eyes >> e & 1) {
                const size_t own = part.eyes.size();
                std::ranges::copy(work.asked.options.foveation.gaze[e], part.options.foveation.gaze[own]);
                part.options.lens[own] = work.asked.options.lens[e];
                part.eyes.push_back(eyes[e]);
                part.targets.push_back(work.target(e, buffer.kind, static_cast<std::byte*>(buffer.pixels)));
            }
    }

    // Waits for the oldest part, copies the picture to where it is delivered, and notes the result.
    void endPart()
    {
        PartInFlight& part = m_flying.front();
        FrameResult result;
        try {
            calling([&] {
                result = finish(*m_renderer, part.request(), part.ticket);
                if (part.bridge != nullptr)
                    land(part);
            });
        } catch (...) {
            failRequest(part.job);
            m_flying.pop_front();
            return;
        }
        const PartInFlight ended = std::move(part);
        m_flying.pop_front();
        std::erase(m_worker->jobs, ended.job);
        if (!m_worker->abandoned && m_service->poses.isDrawing(ended.job))
            noteDrawn(ended, result);
    }

    void land(const PartInFlight& part) const
    {
        const PoseWork& work = *part.work;
        for (uint32_t e = 0; e < work.eyeCount(); ++e) {
            if (!(part.what.eyes >> e & 1))
                continue;
            const EyeParams& eye = work.asked.eyes[e];
            const ColumnRange columns = part.what.columns.within(eye.width);
            const auto bring = [&](size_t at, size_t pixel) {
                part.bridge->land(
                    part.slot, work.memory.get(),
                    {at + columns.first * pixel, eye.width * pixel, (columns.end - columns.first) * pixel, eye.height});
            };
            bring(work.pixels_at[e], pixelBytes(work.asked.format));
            if (work.asked.wants_depth)
                bring(work.depths_at[e], sizeof(float));
        }
        part.bridge->finish();
    }

    void noteDrawn(const PartInFlight& ended, const FrameResult& result)
    {
        Worker& worker = *m_worker;
        const ServiceTime at = m_service->clock.now();
        PoseWork& work = *ended.work;
        PoseWork::Part& drawn = work.parts[ended.job.part];
        drawn.worker = worker.index;
        drawn.busy_ms = milliseconds(at - std::max(ended.since, m_busy_until));
        drawn.result = result;
        m_busy_until = at;
        work.first_parts = work.first_parts || tooEarly(work.asked.options.detail > 0);
        ++m_drawn;
        ++worker.stats.parts;
        worker.stats.busy_ms += drawn.busy_ms;
        worker.faults_in_a_row = 0;
        m_service->sharing.finish(ended.job, work);
    }

    // Returns true if the part's time does not count. With detail, counting starts again after the worker has rested,
    // because the coarse copies are then of old views or missing.
    bool tooEarly(bool coarse)
    {
        const uint64_t starts = m_worker->stats.starts;
        if (coarse && (!m_coarse || starts != m_starts))
            m_drawn = 0;
        m_coarse = coarse;
        m_starts = starts;
        return m_drawn < (coarse ? kFirstCoarseParts : kFirstParts);
    }

    // For a catch block: fails the pose of `job` if no worker could draw it; otherwise rethrows the fault, which then
    // counts as the worker's.
    void failRequest(const Job& job)
    {
        const std::exception_ptr error = std::current_exception();
        if (!isOfRequest(error))
            throw;
        std::erase(m_worker->jobs, job);
        m_service->poses.fail(job, error);
        m_service->worker_wakes.notify_all();
    }

    // Stops delivering in memory of a lost device. Called before the renderer is destroyed, which resets the device
    // and makes that memory useless.
    void forgetLost()
    {
        DeliveryMemory& memory = m_service->pictures;
        const DeliveryMemory::Pictures pictures = memory.of(true);
        if (pictures == nullptr || !calling([&] { return pictures->lost(); }) || memory.of(true) != pictures)
            return;
        const DeviceId& first = m_service->options.devices.front();
        memory.moveTo(devicePictures(first.backend == "auto" ? m_worker->stats.device : first));
    }

    // Destroys the renderer, which waits for its frames, and then the frames with their pictures' memory.
    void letGo()
    {
        m_bridge.reset();
        m_bridge_to.reset();
        m_renderer.reset();
        m_flying.clear();
    }

    const std::shared_ptr<ServiceState> m_service;
    const WorkerPtr m_worker;
    std::unique_lock<std::mutex> m_lock; // lock of the service's mutex
    std::deque<PartInFlight> m_flying;   // parts in flight, oldest first
    std::unique_ptr<Renderer> m_renderer;
    std::shared_ptr<PictureBridge> m_bridge;
    std::shared_ptr<PictureMemory> m_bridge_to;
    ServiceTime m_busy_until{0}; // end of the part that was drawn last
    uint32_t m_drawn = 0;        // parts drawn by the current renderer; with detail, since it had no copies
    bool m_coarse = false;       // true if the last part was drawn with detail
    uint64_t m_starts = 0;       // WorkerStats::starts at the last part
};

} // namespace

void launch(const std::shared_ptr<ServiceState>& service, const WorkerPtr& worker)
{
    const ThreadAttempt attempt;
    try {
        worker->thread = std::thread([service, worker] { WorkerThread(service, worker).run(); });
    } catch (const std::system_error& e) {
        worker->state = WorkerState::Gone;
        worker->stats.last_fault = formatString("no thread for it: %s", e.what());
        service->error = worker->fault = std::make_exception_ptr(tooFewThreads(deviceText(worker->device)));
        if (service->workers.allGone())
            service->poses.failWaiting(service->error);
    }
}

} // namespace gsc
