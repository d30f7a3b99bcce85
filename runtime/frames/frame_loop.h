// SPDX-License-Identifier: Apache-2.0
// The loop over frames: draws shots one after the other, some of them ahead while earlier ones are being used.
#pragma once

#include <gsc/renderer.h>
#include "runtime/frames/shot.h"
#include "runtime/records/frame_numbers.h"
#include "runtime/view/frame_guard.h"

#include <functional>
#include <vector>

namespace gsc {

// A frame, from before it is submitted until it has been used.
struct LoopFrame {
    const Shot* shot = nullptr;
    uint32_t eye_count = 1;
    EyeParams eyes[kMaxEyes];
    FrameOptions options;
    FrameTarget targets[kMaxEyes];       // targets of the eyes, set by the function `prepare`
    bool delivers = false;               // true: pictures are delivered to `targets`; false: they stay on the device
    std::vector<float> images[kMaxEyes]; // pictures of drawToHost(), in memory that later frames use again

    void drawToHost(); // makes `images` the targets, three floats a pixel
};

class FrameLoop {
public:
    using ShotOf = std::function<size_t(size_t frame)>;
    using Prepare = std::function<void(size_t frame, LoopFrame& drawn)>;
    using Done = std::function<void(size_t frame, LoopFrame& drawn, const TimedFrame& timed)>;

    // Prepares to draw shots. Each shot replaces the appearance in `options`. `guard`, if not null, sets the
    // reductions of each frame and receives its time. All arguments must outlive this object.
    FrameLoop(const Scene& scene, const std::vector<Shot>& shots, uint32_t eye_count, const FrameOptions& options,
              Renderer& renderer, FrameGuard* guard = nullptr);

    // Draws `count` frames in order: frame i shows shot `shot_of(i)`; up to `ahead` frames are in flight
    // (Renderer::framesInFlight()). Calls `prepare` before a frame is submitted and `done` when it has ended. Wall
    // times are from submit(), or from the end of the frame before if that is later, to the end. Throws Error
    // (Interrupted, and as Renderer does), or what the calls throw; then no frame is in flight any more.
    void run(size_t count, size_t ahead, const ShotOf& shot_of, const Prepare& prepare, const Done& done);
    // Called by `done`: run() ends after the frames in flight.
    void stop() { m_stops = true; }
    // Draws one frame.
    TimedFrame draw(size_t shot, const Prepare& prepare);

private:
    struct Flying;
    class Flights;

    const Scene& m_scene;
    const std::vector<Shot>& m_shots;
    uint32_t m_eye_count;
    FrameOptions m_options;
    Renderer& m_renderer;
    FrameGuard* m_guard;
    bool m_stops = false;
};

} // namespace gsc
