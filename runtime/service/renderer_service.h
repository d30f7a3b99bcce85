// SPDX-License-Identifier: Apache-2.0
// Draws poses with several renderers, one worker (a thread and a renderer) per device: design section 6, and Algorithm 2 of
// the GS-Cache paper. Poses go in, pictures come out in order; workers start and stop with the rate, and one that fails is
// retired while the others go on.
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
    // the same picture is not drawn: what shows the former shows it, unless that was delivered without some of the
    // model (RendererOptions::first_picture). 0 = such a pose is drawn.
    double still_distance = 0, still_degrees = 0;

    PaceRules pace;                                 // without a limit all workers draw from the start
    ServiceTime deadline{std::chrono::seconds(10)}; // for a part of a frame; a worker that takes longer hangs. 0 = none
    ServiceTime load_deadline{std::chrono::minutes(10)};    // the same for loading the model and for letting it go
    ServiceTime comes_back{std::chrono::milliseconds(250)}; // after a fault; then twice as long, at most 64 times this
    uint32_t most_faults = 4; // of a worker without a part drawn between them, before it stays away
    uint32_t attempts = 3;    // LedgerRules::attempts

    size_t trace_limit = 0; // poses and events that the trace holds
    MakeRenderer make;      // empty = makeRenderer()
};

// Eyes and options that a pose is drawn from; copied by submit().
struct PoseRequest {
    std::vector<EyeParams> eyes; // 1 or 2; not shared by bands where they differ in width
    FrameOptions options{};      // without columns; lod_hysteresis with one worker only, whose frames it follows
    PixelFormat format = PixelFormat::Rgba8;
    bool wants_depth = false; // of each pixel, see FrameTarget
    bool on_device = false;   // delivered in memory of the first worker's device; otherwise of the host
    // Looks once more where the eyes are, right before the pose is begun: fills them, as many and as large, and returns
    // true; false: they stay. Called at most once, by a thread of the service; throws nothing. May be empty.
    std::function<bool(std::span<EyeParams> eyes)> late{};
};

// Its end is Shown, or Failed if all poses are kept.
struct Delivery : EndedPose {
    // One that is shown has these. Targets are of whole pictures, rows without a gap, and live as long as `memory`.
    FrameTarget eyes[kMaxEyes] = {};
    std::shared_ptr<const std::byte> memory{};
    FrameResult result{}; // counts of all workers; times of the one that took longest
    ServiceTime submitted{0}, begun{0}, drawn{0}, delivered{0};
};

class RendererService {
public:
    // Returns when the workers that draw from the start are ready, or have failed. Throws Error: Usage for a device that
    // there is not or options that contradict each other; what all of them failed with where none is ready.
    RendererService(std::shared_ptr<const Scene> scene, const ServiceOptions& options);
    RendererService(const ModelView& model,
                    const ServiceOptions& options); // `model` outlives it, and a worker that hangs
    ~RendererService();                             // waits for what is being drawn, but not for a worker that hangs
    RendererService(const RendererService&) = delete;
    RendererService& operator=(const RendererService&) = delete;

    // All may be called from any thread.

    // Takes a pose to be drawn; its number, from 1, or that of the pose before if it is as good as still (still_distance).
    // Does not wait. Throws Error(Usage) for what no worker could draw.
    uint64_t submit(const PoseRequest& request);

    // Waits for what is delivered next, at most so long. Nothing if the time has passed, or if no pose is open.
    std::optional<Delivery> next(std::chrono::nanoseconds most = std::chrono::nanoseconds::max());

    void dropCaches(); // every renderer draws its next frame as if it were the first; no pose may be open

    [[nodiscard]] ServiceStats stats() const;
    [[nodiscard]] ServiceTrace trace() const; // so far
    [[nodiscard]] ServiceTime now() const;    // of the service's clock
    // Answers of the first worker that was ready, as its Renderer gives them.
    [[nodiscard]] DeviceFacts device() const;
    [[nodiscard]] Tier tierOf(Tier asked) const;

private:
    RendererService(std::shared_ptr<const Scene> scene, const ModelView& model, const ServiceOptions& options);
    void start();
    void stop();

    std::shared_ptr<ServiceState> m_state; // also held by a worker that hangs
    std::thread m_keeper;
};

} // namespace gsc
