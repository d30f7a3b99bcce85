// SPDX-License-Identifier: Apache-2.0
// Draws poses with several renderers, one worker (a thread and a renderer) per device: design section 6, and Algorithm 2 of
// the GS-Cache paper. Poses go in, pictures come out in order; workers start and stop with the rate, and one that fails is
// retired while the others continue.
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
    std::vector<DeviceId> devices{DeviceId{}}; // a worker each; one may be named more than once
    RendererOptions renderer;
    ServiceMode mode = ServiceMode::Frame;

    // All poses are drawn and delivered in order, none is dropped: for files and benches. Otherwise the newest pose is
    // drawn next and the newest picture delivered: for a viewer.
    bool keeps_all = false;
    ServiceTime timeout{0}; // LedgerRules::timeout
    // A pose whose eyes are all this near to the pose accepted before (world units; degrees of direction) and that asks for
    // the same picture is not drawn: the former picture stays, unless it was drawn before all of the model was loaded
    // (RendererOptions::first_picture). 0 = every pose is drawn.
    double still_distance = 0, still_degrees = 0;

    PaceRules pace;                                 // without a limit all workers draw from the start
    ServiceTime deadline{std::chrono::seconds(10)}; // a worker that takes longer for a part counts as hung. 0 = none
    ServiceTime load_deadline{std::chrono::minutes(10)};    // `deadline` for loading the model and for giving it back
    ServiceTime comes_back{std::chrono::milliseconds(250)}; // pause after a fault; doubles with each, up to 64 times
    uint32_t most_faults = 4; // faults of a worker with no part drawn between them, before it stays away
    uint32_t attempts = 3;    // LedgerRules::attempts

    size_t trace_limit = 0; // poses and events that the trace holds
    MakeRenderer make;      // empty = makeRenderer()
};

// Eyes and options that a pose is drawn from; copied by submit().
struct PoseRequest {
    std::vector<EyeParams> eyes; // 1 or 2; eyes of different widths are not cut into bands
    FrameOptions options{};      // no columns; lod_hysteresis only with one worker, whose frames it follows
    PixelFormat format = PixelFormat::Rgba8;
    bool wants_depth = false; // deliver the depth of each pixel, see FrameTarget
    bool on_device = false;   // deliver in memory of the first worker's device, not of the host
    // Asked for newer eyes right before the pose is begun: fills as many eyes, of the same sizes, and returns true; false
    // keeps the old. Called at most once, by a thread of the service; must not throw. May be empty.
    std::function<bool(std::span<EyeParams> eyes)> late{};
};

// A pose that ended: as Shown, or with keeps_all also as Failed.
struct Delivery : EndedPose {
    // Set for a shown pose. Targets hold whole pictures, rows without a gap, and are valid as long as `memory` lives.
    FrameTarget eyes[kMaxEyes] = {};
    std::shared_ptr<const std::byte> memory{};
    FrameResult result{}; // counts of all workers; times of the one that took longest
    ServiceTime submitted{0}, begun{0}, drawn{0}, delivered{0};
};

class RendererService {
public:
    // Returns when the workers that draw from the start are ready or have failed. Throws Error: Usage for a device that
    // does not exist or options that contradict each other; if no worker is ready, the error they failed with.
    RendererService(std::shared_ptr<const Scene> scene, const ServiceOptions& options);
    RendererService(const ModelView& model,
                    const ServiceOptions& options); // `model` must outlive this and every worker that hangs
    ~RendererService();                             // waits for frames being drawn, but not for a worker that hangs
    RendererService(const RendererService&) = delete;
    RendererService& operator=(const RendererService&) = delete;

    // All functions below may be called from any thread.

    // Submits a pose. Returns its number, counted from 1, or that of the pose before if the eyes hardly moved
    // (still_distance). Does not wait. Throws Error(Usage) for a request that no worker could draw.
    uint64_t submit(const PoseRequest& request);

    // Waits at most so long for the next delivery. Returns none if the time has passed, or if no pose is open.
    std::optional<Delivery> next(std::chrono::nanoseconds most = std::chrono::nanoseconds::max());

    void dropCaches(); // every renderer draws its next frame as if it were the first; no pose may be open

    [[nodiscard]] ServiceStats stats() const;
    [[nodiscard]] ServiceTrace trace() const; // the trace so far
    [[nodiscard]] ServiceTime now() const;    // time of the service's clock
    // Answers of the Renderer of the first worker that was ready.
    [[nodiscard]] DeviceFacts device() const;
    [[nodiscard]] Tier tierOf(Tier asked) const;

private:
    RendererService(std::shared_ptr<const Scene> scene, const ModelView& model, const ServiceOptions& options);
    void start();
    void stop();

    std::shared_ptr<ServiceState> m_state; // shared with a worker that hangs
    std::thread m_keeper;
};

} // namespace gsc
