// SPDX-License-Identifier: Apache-2.0
#include "runtime/frames/frame_loop.h"

#include <gsc/interrupt.h>
#include "kernels/threads/stopwatch.h"

#include <algorithm>
#include <chrono>
#include <deque>
#include <memory>
#include <utility>

namespace gsc {

using Clock = std::chrono::steady_clock;

void LoopFrame::drawToHost()
{
    delivers = true;
    for (uint32_t e = 0; e < eye_count; ++e) {
        images[e].resize(size_t(shot->camera.width) * shot->camera.height * 3);
        targets[e] = hostTarget(images[e].data());
    }
}

struct FrameLoop::Flying {
    LoopFrame frame;
    FrameRequest request;
    uint64_t ticket = 0;
    bool submitted = false;
    Clock::time_point start;
};

// Frames in flight, the oldest first.
class FrameLoop::Flights {
public:
    explicit Flights(Renderer& renderer) : m_renderer(renderer) {}
    // Waits for the frames in flight, because the renderer draws into memory that is freed here.
    ~Flights()
    {
        for (const std::unique_ptr<Flying>& flying : m_flying)
            try {
                FrameResult ignored;
                if (flying->submitted)
                    (void)m_renderer.wait(flying->ticket, ignored);
            } catch (...) { // ignored: the caller already has the first error
            }
    }
    Flights(const Flights&) = delete;
    Flights& operator=(const Flights&) = delete;

    [[nodiscard]] size_t count() const { return m_flying.size(); }

    Flying& add() { return *m_flying.emplace_back(m_spare ? std::move(m_spare) : std::make_unique<Flying>()); }

    // Waits for the oldest frame. The result is valid until the next add() or end().
    Flying& end(TimedFrame& timed)
    {
        Flying& flying = *m_flying.front();
        const LoopFrame& frame = flying.frame;
        timed.result = finish(m_renderer, flying.request, flying.ticket);
        const Clock::time_point now = Clock::now();
        timed.wall_ms = milliseconds(now - std::max(flying.start, m_last_end));
        timed.pixels = double(frame.shot->camera.width) * frame.shot->camera.height;
        timed.lod_bias = double(frame.options.lod_bias);
        timed.detail = double(frame.options.detail);
        m_last_end = now;
        m_spare = std::move(m_flying.front());
        m_flying.pop_front();
        return *m_spare;
    }

private:
    Renderer& m_renderer;
    std::deque<std::unique_ptr<Flying>> m_flying;
    std::unique_ptr<Flying> m_spare;
    Clock::time_point m_last_end{};
};

FrameLoop::FrameLoop(const Scene& scene, const std::vector<Shot>& shots, uint32_t eye_count,
                     const FrameOptions& options, Renderer& renderer, FrameGuard* guard)
    : m_scene(scene), m_shots(shots), m_eye_count(eye_count), m_options(options), m_renderer(renderer), m_guard(guard)
{
}

void FrameLoop::run(size_t count, size_t ahead, const ShotOf& shot_of, const Prepare& prepare, const Done& done)
{
    Flights flights(m_renderer);
    size_t begun = 0;
    for (size_t ended = 0; ended < count; ++ended) {
        for (; begun < count && flights.count() < ahead; ++begun) {
            Flying& flying = flights.add();
            LoopFrame& frame = flying.frame;
            frame.shot = &m_shots[shot_of(begun)];
            frame.eye_count = m_eye_count;
            frame.delivers = flying.submitted = false;
            shotEyes(*frame.shot, m_eye_count, frame.eyes);
            frame.options = m_options;
            frame.options.appearance = shotAppearance(m_scene, *frame.shot);
            if (m_guard)
                m_guard->applyTo(frame.options);
            if (prepare)
                prepare(begun, frame);
            throwIfInterrupted();
            flying.request = {{frame.eyes, m_eye_count}, {}, frame.options};
            if (frame.delivers)
                flying.request.targets = {frame.targets, m_eye_count};
            flying.start = Clock::now();
            flying.ticket = m_renderer.submit(flying.request);
            flying.submitted = true;
        }
        TimedFrame timed;
        Flying& flying = flights.end(timed);
        if (m_guard)
            m_guard->add(timed.result.times.total);
        done(ended, flying.frame, timed);
        if (std::exchange(m_stops, false))
            count = begun;
    }
}

TimedFrame FrameLoop::draw(size_t shot, const Prepare& prepare)
{
    TimedFrame drawn;
    run(
        1, 1, [shot](size_t) { return shot; }, prepare,
        [&drawn](size_t, LoopFrame&, const TimedFrame& timed) { drawn = timed; });
    return drawn;
}

} // namespace gsc
