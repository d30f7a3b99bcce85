// SPDX-License-Identifier: Apache-2.0
// Frames that are drawn while others are being used.
#pragma once

#include "player/frames/shots.h"
#include "runtime/records/frame_numbers.h"
#include <gsc/renderer.h>
#include <gsc/scene.h>

#include <deque>
#include <memory>
#include <vector>

namespace gsc {

// Shots that are drawn while pictures of those before are written.
class ShotsInFlight {
public:
    // All must outlive this.
    ShotsInFlight(const Scene& scene, uint32_t eye_count, Renderer& renderer);

    ~ShotsInFlight();
    ShotsInFlight(const ShotsInFlight&) = delete;
    ShotsInFlight& operator=(const ShotsInFlight&) = delete;

    // At most Renderer::framesInFlight(). Sets the appearance in `frame`.
    void begin(const Shot& shot, FrameOptions& frame);
    [[nodiscard]] size_t count() const { return m_flying.size(); }
    // Ends the one begun first: its pictures, one per eye, take the place of what `images` had, whose memory is used again.
    TimedFrame end(std::vector<float>* images);

private:
    struct Flying;
    const Scene& m_scene;
    uint32_t m_eye_count;
    Renderer& m_renderer;
    std::deque<std::unique_ptr<Flying>> m_flying;
    std::unique_ptr<Flying> m_spare;
};

} // namespace gsc
