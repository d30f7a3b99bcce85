// SPDX-License-Identifier: Apache-2.0
// Draws a model on one device. Any number of renderers can share a Scene; each is used from one thread at a time.
#pragma once

#include <gsc/frame_target.h>
#include <gsc/frame_types.h>
#include <gsc/device.h>
#include <gsc/scene.h>

#include <chrono>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace gsc {

struct RendererOptions {
    int threads = 0; // on the host: threads that draw; on a GPU: most threads that read the model; 0 = all cores
    // most device memory for this renderer in bytes, DeviceFacts::context_bytes included; 0 = no limit. Has no
    // effect on the host. If it is too low for the model, load() throws OutOfMemory; for a frame, submit() does.
    uint64_t memory_bytes = 0;
    // True: load() does not wait for the anchors: frames show those that have been loaded so far, coarse levels
    // and near chunks first (FrameResult::anchors_absent). Tier exact waits for all.
    bool first_picture = false;
    // With FrameOptions::detail, make every due coarse copy, however long a frame takes. For workers that share poses:
    // the copies then depend only on the poses and the groups.
    bool coarse_unlimited = false;
};

// Eyes that a frame is drawn from, its targets and its options. submit() copies all of it, but not the memory of the
// targets.
struct FrameRequest {
    std::span<const EyeParams> eyes;        // the eyes to draw, one or two
    std::span<const FrameTarget> targets{}; // a target for each eye; empty: the pictures stay on the device
    FrameOptions options{};
    uint64_t repeats = 0; // ticket of an overflowed frame that this request draws again; 0 = none
};

enum class FrameState {
    Done,
    Pending, // the frame is not drawn yet: call wait() again
    // a buffer was too small and the targets are invalid: draw the frame again (FrameRequest::repeats) or drop it
    Overflowed,
};

constexpr uint32_t kFramesInFlight = 2; // most frames in flight of a renderer on one device

class Renderer {
public:
    virtual ~Renderer() = default;

    [[nodiscard]] virtual DeviceId id() const = 0;
    [[nodiscard]] virtual DeviceFacts device() const = 0;
    [[nodiscard]] virtual bool onHost() const = 0; // true if the device is the host
    // True if the renderer can draw into targets in memory of its device.
    [[nodiscard]] virtual bool takesDeviceTargets() const { return true; }

    // Measures the device's highest rates, which takes some tenths of a second and device memory. All are 0 if the
    // backend cannot measure. Throws Error (OutOfMemory, Device).
    [[nodiscard]] virtual DeviceCeilings ceilings() { return {}; }

    // Returns the tier in which a frame is drawn that asks for tier `asked`.
    [[nodiscard]] virtual Tier tierOf(Tier asked) const = 0;

    // Load a model and drop frames in flight. Throw Error (OutOfMemory, Unsupported, Device).
    virtual void load(std::shared_ptr<const Scene> scene);
    // The model, with all that it points to, must outlive this renderer or the next load().
    virtual void load(const ModelView& model) = 0;

    // Most frames that may be submitted and not yet ended by wait().
    [[nodiscard]] virtual uint32_t framesInFlight() const { return kFramesInFlight; }

    // Forgets everything kept from earlier frames, as if the next frame were the first; buffers stay. Precondition: no
    // frame is in flight.
    virtual void dropCaches() = 0;

    // Submits a frame and returns its ticket: 1, 2, 3 and so on. It waits for the device only if memory must grow (in
    // the first frames, for a new size, after an overflow) or if the appearance differs from that of the frame before.
    //
    // A frame is in flight from submit() until a wait() that does not return Pending; at most framesInFlight() frames
    // may be. Frames are drawn in order. The content of caches and the number of passes depend only on what was
    // submitted, never on timing. Both rules have an exception while RendererOptions::first_picture loads the model:
    // submit() waits for anchors, and shows those that have been loaded.
    //
    // Throws Error: Usage for a request that cannot be drawn, Unsupported, OutOfMemory, Device.
    virtual uint64_t submit(const FrameRequest& request) = 0;

    // Waits until a frame in flight is drawn, or `most` has passed; then copies a picture for the host, for which
    // `most` does not count. `result` is filled unless Pending is returned. Throws Error: Device if the device is lost
    // (destroy all of its renderers before making new ones, which the driver may still refuse to this process); also
    // errors of submit() that are found only later.
    virtual FrameState wait(uint64_t ticket, FrameResult& result,
                            std::chrono::nanoseconds most = std::chrono::nanoseconds::max()) = 0;

    // Returns a cudaEvent_t that passes when a frame in flight is in its targets, for targets on the device. Null on
    // the host.
    [[nodiscard]] virtual void* readyEvent(uint64_t) const { return nullptr; }

private:
    std::shared_ptr<const Scene> m_scene;
};

// Makes a renderer. Throws Error: Usage for a backend or device that does not exist, naming those that do; Device or
// Unsupported for one that this machine cannot run; OutOfMemory. `warning`, if not null, is called with each device
// that "auto" passes over, and why.
std::unique_ptr<Renderer> makeRenderer(const DeviceId& device, const RendererOptions& options = {},
                                       std::string* warning = nullptr);

// Makes a renderer and loads the model. With "auto", the CPU loads a model for which a better device lacks memory or
// support. Each device passed over is added to `passed_over` with the reason; `load_ms`, if not null, receives the
// time of loading.
std::unique_ptr<Renderer> makeLoadedRenderer(const DeviceId& device, const RendererOptions& options,
                                             std::shared_ptr<const Scene> scene, std::vector<std::string>& passed_over,
                                             double* load_ms = nullptr);

// Waits for a frame, and submits it again as long as it overflows. The times in the result are sums over all tries.
// Throws as submit() and wait() do.
FrameResult finish(Renderer& renderer, const FrameRequest& request, uint64_t ticket);
// Submits a frame and waits for it as finish() does.
FrameResult render(Renderer& renderer, const FrameRequest& request);
// Does as render(), into pictures of height x width x 3 floats in memory of this process, one for each eye. If
// `images` or an entry is null, the picture stays on the device.
FrameResult render(Renderer& renderer, std::span<const EyeParams> eyes, const FrameOptions& options,
                   float* const* images = nullptr);

} // namespace gsc
