// SPDX-License-Identifier: Apache-2.0
#include "player/frames/shots_in_flight.h"

#include <gsc/interrupt.h>

#include <chrono>
#include <utility>

namespace gsc {

namespace {

using Clock = std::chrono::steady_clock;

} // namespace

struct ShotsInFlight::Flying {
    EyeParams eyes[kMaxEyes];
    std::vector<float> pixels[kMaxEyes];
    FrameTarget targets[kMaxEyes];
    FrameRequest request;
    uint64_t ticket = 0;
    TimedFrame timed;
    Clock::time_point start;
};

ShotsInFlight::ShotsInFlight(const Scene& scene, uint32_t eye_count, Renderer& renderer)
    : m_scene(scene), m_eye_count(eye_count), m_renderer(renderer)
{
}

// The renderer draws into pictures that go with this.
ShotsInFlight::~ShotsInFlight()
{
    for (const std::unique_ptr<Flying>& flying : m_flying)
        try {
            FrameResult ignored;
            (void)m_renderer.wait(flying->ticket, ignored);
        } catch (...) { // one that was never submitted, or what has failed already
        }
}

void ShotsInFlight::begin(const Shot& shot, FrameOptions& frame)
{
    throwIfInterrupted();
    m_flying.push_back(m_spare ? std::move(m_spare) : std::make_unique<Flying>());
    Flying& flying = *m_flying.back();
    shotEyes(shot, m_eye_count, flying.eyes);
    frame.appearance = shotAppearance(m_scene, shot);
    for (uint32_t e = 0; e < m_eye_count; ++e) {
        flying.pixels[e].resize(size_t(shot.camera.width) * shot.camera.height * 3);
        flying.targets[e] = hostTarget(flying.pixels[e].data());
    }
    flying.request = {{flying.eyes, m_eye_count}, {flying.targets, m_eye_count}, frame};
    flying.timed = {0, {}, double(shot.camera.width) * shot.camera.height, double(frame.lod_bias)};
    flying.start = Clock::now();
    flying.ticket = m_renderer.submit(flying.request);
}

TimedFrame ShotsInFlight::end(std::vector<float>* images)
{
    Flying& flying = *m_flying.front();
    flying.timed.result = finish(m_renderer, flying.request, flying.ticket);
    flying.timed.wall_ms = std::chrono::duration<double, std::milli>(Clock::now() - flying.start).count();
    for (uint32_t e = 0; e < m_eye_count; ++e)
        std::swap(images[e], flying.pixels[e]);
    m_spare = std::move(m_flying.front());
    m_flying.pop_front();
    return m_spare->timed;
}

} // namespace gsc
