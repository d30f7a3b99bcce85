// SPDX-License-Identifier: Apache-2.0
// Plays a model on one device. Any number of renderers share a Scene; each is used from one thread at a time.
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
    int threads = 0; // threads of a renderer on the host; for a GPU, most that read the model. 0 = all cores
    uint64_t memory_bytes =
        0; // most of the device that this renderer may take, DeviceFacts::context_bytes included; 0 = all.
           // Too few for the model: load() throws OutOfMemory; for a frame: submit(). Not on the host
    // load() does not wait for the anchors: frames show those that have come by then, coarse levels and near chunks first
    // (FrameResult::anchors_absent). Tier exact waits for all.
    bool first_picture = false;
    // With FrameOptions::detail, make every due coarse copy, however long a frame takes: for workers that share poses,
    // so that the due copies follow from poses and group alone.
    bool coarse_unlimited = false;
};

// Eyes that a frame is drawn from, its targets and options. submit() copies it, but not the memory of the targets.
struct FrameRequest {
    std::span<const EyeParams> eyes;        // 1 or 2
    std::span<const FrameTarget> targets{}; // one per eye, or none: pictures stay on the device
    FrameOptions options{};
    uint64_t repeats = 0; // ticket of an overflowed frame that this one draws again; 0 = none
};

enum class FrameState {
    Done,
    Pending,    // not drawn yet; ask again
    Overflowed, // a buffer was too small and the targets are invalid: draw it again (FrameRequest::repeats) or drop it
};

constexpr uint32_t kFramesInFlight = 2; // frames in flight of a renderer on one device

class Renderer {
public:
    virtual ~Renderer() = default;

    [[nodiscard]] virtual DeviceId id() const = 0;
    [[nodiscard]] virtual DeviceFacts device() const = 0;
    [[nodiscard]] virtual bool onHost() const = 0; // the device is the host
    // Draws into targets in memory of its device.
    [[nodiscard]] virtual bool takesDeviceTargets() const { return true; }

    // Measures them, which takes some tenths of a second and device memory. Unknown if the backend has no measurement.
    // Throws Error (OutOfMemory, Device).
    [[nodiscard]] virtual DeviceCeilings ceilings() { return {}; }

    // Tier in which a frame is rendered that asks for `asked`.
    [[nodiscard]] virtual Tier tierOf(Tier asked) const = 0;

    // Forget frames in flight. Throw Error (OutOfMemory, Unsupported, Device).
    virtual void load(std::shared_ptr<const Scene> scene);
    // the model, with all it points to, must outlive this or the next load()
    virtual void load(const ModelView& model) = 0;

    // Frames that may be between submit() and a wait() that ends them.
    [[nodiscard]] virtual uint32_t framesInFlight() const { return kFramesInFlight; }

    // Forgets everything kept from earlier frames, as if the next frame were the first; buffers stay. No frame may be
    // in flight.
    virtual void dropCaches() = 0;

    // Returns the frame's ticket, from 1 in order. Does not wait for the device, but where its memory must grow (in first
    // frames, at a new size, after an overflow) or the appearance is another than the frame before had. At most
    // framesInFlight() are in flight, which is from submit() to a wait() that does not say Pending. Frames are drawn in
    // order; what is kept from frame to frame, and how a frame is cut into passes, follows from what was submitted, never
    // from what was ready when. RendererOptions::first_picture breaks both until the model has come: it waits for anchors,
    // and shows those that are there. Throws Error: Usage for what cannot be drawn, Unsupported, OutOfMemory, Device.
    virtual uint64_t submit(const FrameRequest& request) = 0;

    // Waits for a frame in flight until it is drawn, or `most` has passed. Copies a picture for the host, which is not part
    // of that. `result` is filled unless it says Pending. Throws Error: Device where the device is lost, after which all
    // its renderers are to be destroyed before others are made (which the driver may refuse this process); what submit()
    // throws where it is found out later.
    virtual FrameState wait(uint64_t ticket, FrameResult& result,
                            std::chrono::nanoseconds most = std::chrono::nanoseconds::max()) = 0;

    // A cudaEvent_t that passes when a frame in flight is in its target, for targets on the device. Null on a host.
    [[nodiscard]] virtual void* readyEvent(uint64_t) const { return nullptr; }

private:
    std::shared_ptr<const Scene> m_scene;
};

// Throws Error: Usage for a backend or device that does not exist, naming those that do; Device or Unsupported for one
// that this machine cannot run; OutOfMemory. `warning`, if not null, takes the devices that "auto" skips, and why.
std::unique_ptr<Renderer> makeRenderer(const DeviceId& device, const RendererOptions& options = {},
                                       std::string* warning = nullptr);

// makeRenderer(), with the model loaded. With "auto", the CPU loads a model that a better backend cannot load, for want
// of memory or of support. Each device passed over is added to `passed_over` with the reason; `load_ms`, if not null,
// is how long loading took.
std::unique_ptr<Renderer> makeLoadedRenderer(const DeviceId& device, const RendererOptions& options,
                                             std::shared_ptr<const Scene> scene, std::vector<std::string>& passed_over,
                                             double* load_ms = nullptr);

// Waits for a frame, and submits it again for as long as it overflows. The times are those of every try. Throws as both.
FrameResult finish(Renderer& renderer, const FrameRequest& request, uint64_t ticket);
// Submits a frame and finishes it.
FrameResult render(Renderer& renderer, const FrameRequest& request);
// render() into pictures of height x width x 3 floats in memory of this process, one per eye; if `images` or an entry
// is null, the picture stays on the device.
FrameResult render(Renderer& renderer, std::span<const EyeParams> eyes, const FrameOptions& options,
                   float* const* images = nullptr);

} // namespace gsc
