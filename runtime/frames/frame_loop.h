// SPDX-License-Identifier: Apache-2.0
// The loop over frames: draws shots one after the other, some of them while those before are being used.
#pragma once

#include <gsc/renderer.h>
#include "runtime/frames/shot.h"
#include "runtime/records/frame_numbers.h"
#include "runtime/view/frame_guard.h"

#include <functional>
#include <vector>

namespace gsc {

// A frame from before it is submitted until it has been used.
struct LoopFrame {
    const Shot* shot = nullptr;
    uint32_t eye_count = 1;
    EyeParams eyes[kMaxEyes];
    FrameOptions options;
    FrameTarget targets[kMaxEyes];       // set by prepare()
    bool delivers = false;               // `targets` take the pictures; else they stay on the device
    std::vector<float> images[kMaxEyes]; // pictures of drawToHost(), in memory that every frame uses again

    void drawToHost(); // three floats a pixel, into `images`
};

class FrameLoop {
public:
    using ShotOf = std::function<size_t(size_t frame)>;
    using Prepare = std::function<void(size_t frame, LoopFrame& drawn)>;
    using Done = std::function<void(size_t frame, LoopFrame& drawn, const TimedFrame& timed)>;

    // The appearance of `options` is replaced by each shot's. `guard`, if not null, chooses each frame's reductions and
    // is told its time. All must outlive this.
    FrameLoop(const Scene& scene, const std::vector<Shot>& shots, uint32_t eye_count, const FrameOptions& options,
              Renderer& renderer, FrameGuard* guard = nullptr);

    // Draws `count` frames, frame i of shot `shot_of(i)`, at most `ahead` of them at once (Renderer::framesInFlight()), in
    // order. `prepare` comes before a frame is submitted, `done` when it has ended. Wall times are from submit() to the
    // end, or since the end of the frame before. Throws Error (Interrupted, and as Renderer), or what the calls throw;
    // then no frame is in flight any more.
    void run(size_t count, size_t ahead, const ShotOf& shot_of, const Prepare& prepare, const Done& done);
    // One frame.
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
};

} // namespace gsc
