// SPDX-License-Identifier: Apache-2.0
#include <gsc/renderer.h>

#include "kernels/threads/stopwatch.h"
#include "runtime/devices/device_fallback.h"

#include <algorithm>
#include <utility>

namespace gsc {

void Renderer::load(std::shared_ptr<const Scene> scene)
{
    load(scene->view());
    m_scene = std::move(scene);
}

std::unique_ptr<Renderer> makeLoadedRenderer(const DeviceId& device, const RendererOptions& options,
                                             std::shared_ptr<const Scene> scene, std::vector<std::string>& passed_over,
                                             double* load_ms)
{
    DeviceId taken = device;
    const auto passOver = [&](const std::string& why) { passed_over.push_back(why); };
    const auto open = [&](const DeviceId& on) {
        std::string warning;
        // a CPU device has no number, though a DeviceId may state one
        const int ordinal = on.backend.starts_with("cpu") ? 0 : on.ordinal;
        std::unique_ptr<Renderer> renderer = makeRenderer({on.backend, ordinal}, options, &warning);
        if (!warning.empty())
            passOver(warning);
        taken = renderer->id();
        Stopwatch watch;
        renderer->load(scene);
        if (load_ms != nullptr)
            *load_ms = watch.lap();
        return renderer;
    };
    return orOnCpu(device, taken, open, passOver);
}

FrameResult finish(Renderer& renderer, const FrameRequest& request, uint64_t ticket)
{
    FrameRequest again = request;
    FrameResult result;
    StageTimes all;
    for (uint32_t repeats = 0;; ++repeats) {
        const FrameState state = renderer.wait(ticket, result);
        const double last_ms = result.times.total;
        all.add(result.times);
        if (state == FrameState::Done) {
            result.times = all;
            result.repeats = repeats;
            result.repeat_ms = all.total - last_ms;
            return result;
        }
        again.repeats = ticket;
        ticket = renderer.submit(again);
    }
}

FrameResult render(Renderer& renderer, const FrameRequest& request)
{
    return finish(renderer, request, renderer.submit(request));
}

FrameResult render(Renderer& renderer, std::span<const EyeParams> eyes, const FrameOptions& options,
                   float* const* images)
{
    FrameTarget targets[kMaxEyes];
    for (size_t e = 0; images != nullptr && e < std::min<size_t>(eyes.size(), kMaxEyes); ++e)
        if (images[e] != nullptr)
            targets[e] = hostTarget(images[e]);
    return render(
        renderer,
        FrameRequest{eyes, std::span(targets).first(images ? std::min<size_t>(eyes.size(), kMaxEyes) : 0), options});
}

} // namespace gsc
