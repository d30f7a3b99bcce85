// SPDX-License-Identifier: Apache-2.0
#include "runtime/renderer.h"

#include <algorithm>

namespace gsc {

void Renderer::load(std::shared_ptr<const Scene> scene)
{
    load(scene->view());
    m_scene = std::move(scene);
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
