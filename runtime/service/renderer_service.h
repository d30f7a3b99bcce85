// SPDX-License-Identifier: Apache-2.0
// Draws poses with several renderers: one worker (a thread and a renderer) for each device; see design section 6, and
// Algorithm 2 of the GS-Cache paper. Poses are submitted, and pictures are delivered in order. Workers are started and
// stopped by the rate; a worker that fails is retired while the others continue.
#pragma once

#include <gsc/renderer.h>
#include "runtime/service/policy/mode_choice.h"
#include "runtime/service/policy/pace.h"
#include "runtime/service/pose_ledger.h"
#include "runtime/service/service_trace.h"

#include <functional>
#include <thread>

namespace gsc {

using MakeRenderer = std::function<std::unique_ptr<Renderer>(const DeviceId&, const RendererOptions&)>;

struct ServiceState;

struct ServiceOptions {
    // devices that draw, a worker for each entry; a device may be named more than once
    std::vector<DeviceId> devices{DeviceId{}};
    RendererOptions renderer;
    ServiceMode mode = ServiceMode::Frame;

    // True: all poses are drawn and delivered in order, and none is dropped, for files and benches. False: the newest
    // pose is drawn next and the newest picture delivered, for a viewer.
    bool keeps_all = false;
    ServiceTime timeout{0}; // longest wait of a pose before it is begun (LedgerRules::timeout); 0 = no limit
    // A pose is not drawn if all of its eyes are as near as this to those of the last accepted pose (distance in world
    // units; degrees between directions) and it asks for the same kind of picture. The earlier picture then stays,
    // unless it was drawn before all of the model was loaded (RendererOptions::first_picture). 0 = every pose is
    // drawn.
    double still_distance = 0, still_degrees = 0;

    PaceRules pace; // when workers start and stop; without min_fps all draw from the start
    // a worker that takes longer than this for a part counts as hung; 0 = no limit
    ServiceTime deadline{std::chrono::seconds(10)};
    ServiceTime load_deadline{std::chrono::minutes(10)}; // longest time for loading the model, and for freeing it
    // pause of a worker after a fault; doubled for each further fault, up to 64 times as long
    ServiceTime comes_back{std::chrono::milliseconds(250)};
    uint32_t most_faults = 4; // faults of a worker without a part drawn in between, after which it does not come back
    uint32_t attempts = 3;    // tries to draw a part before the pose fails (LedgerRules::attempts)

    size_t trace_limit = 0; // largest number of poses, and of events, in the trace
    MakeRenderer make;      // function that makes renderers; empty = makeRenderer()
};

// Eyes and options that a pose is drawn with; submit() copies them.
struct PoseRequest {
    std::vector<EyeParams> eyes; // one or two eyes; eyes of different widths are not cut into bands
    // must not set columns; may set lod_hysteresis only with one worker, because it depends on the frames before
    FrameOptions options{};
    PixelFormat format = PixelFormat::Rgba8;
    bool wants_depth = false; // true: deliver the depth of each pixel, too (FrameTarget)
    bool on_device = false;   // true: deliver in memory of the first worker's device; false: of the host
    // Called right before the pose is begun to get newer eyes: fills `eyes`, which keep number and sizes, and returns
    // true; false keeps the old ones. Called at most once, by a thread of the service; must not throw. May be empty.
    std::function<bool(std::span<EyeParams> eyes)> late{};
};

// A pose that was shown; with keeps_all also one that failed.
struct Delivery : EndedPose {
    // Pictures of a shown pose: whole pictures, rows without gaps, valid as long as `memory` lives.
    FrameTarget eyes[kMaxEyes] = {};
    std::shared_ptr<const std::byte> memory{};
    FrameResult result{}; // counts summed over all workers; times of the worker that took longest
    ServiceTime submitted{0}, begun{0}, drawn{0}, delivered{0};
};

class RendererService {
public:
    // Starts the workers. Returns when those that draw from the start are ready or have failed. Throws Error: Usage
    // for a device that does not exist or options that contradict each other; if no worker is ready, the error of one
    // of them.
    RendererService(std::shared_ptr<const Scene> scene, const ServiceOptions& options);
    RendererService(const ModelView& model,
                    // without a Scene: `model` must outlive the service and every worker that hangs
                    const ServiceOptions& options);
    ~RendererService(); // waits for frames that are being drawn, but not for a worker that hangs
    RendererService(const RendererService&) = delete;
    RendererService& operator=(const RendererService&) = delete;

    // All functions below may be called from any thread.

    // Submits a pose, without waiting. Returns the number of the pose, counted from 1, or that of the pose before if
    // the eyes hardly moved (still_distance). Throws Error(Usage) for a request that no worker could draw.
    uint64_t submit(const PoseRequest& request);

    // Waits up to `most` for the next delivery. Returns none if there is none by then, or if no pose is open.
    std::optional<Delivery> next(std::chrono::nanoseconds most = std::chrono::nanoseconds::max());

    void dropCaches(); // every renderer draws the next frame as if it were the first; no pose may be open

    [[nodiscard]] ServiceStats stats() const;
    [[nodiscard]] ServiceTrace trace() const; // returns the trace so far
    [[nodiscard]] ServiceTime now() const;    // present time of the service's clock
    // device() and tierOf() return what the Renderer of the worker that was ready first returns.
    [[nodiscard]] DeviceFacts device() const;
    [[nodiscard]] Tier tierOf(Tier asked) const;

private:
    RendererService(std::shared_ptr<const Scene> scene, const ModelView& model, const ServiceOptions& options);
    void start();
    void stop();

    std::shared_ptr<ServiceState> m_state; // state of the service, shared with workers that hang
    std::thread m_keeper;
};

} // namespace gsc
