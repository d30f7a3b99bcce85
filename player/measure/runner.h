// SPDX-License-Identifier: Apache-2.0
// Renders a path once, from a cold start, and says what its frames cost and how far they are from exact.
#pragma once

#include "player/measure/accuracy.h"
#include "player/report/frame_numbers.h"
#include "player/shots.h"
#include "runtime/renderer.h"
#include "runtime/scene.h"

#include <deque>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace gsc {

// The poses of one trajectory, as a run asks for them.
struct Path {
    std::string name;    // that the trajectory states, or its file's stem
    std::string cameras; // as the caller named it
    std::vector<Shot> shots;
    uint32_t eye_count = 1;
};

// Reads `options.cameras`. `listed` is what reports call it. Throws Error (Usage, Io, InvalidFile).
Path openPath(const Scene& scene, const PlayOptions& options, const std::string& listed, Reporter& log);

// Renders a shot into `images`, one per eye, or leaves it on the device if that is null. Sets the appearance in `frame`.
TimedFrame renderShot(const Scene& scene, const Shot& shot, uint32_t eye_count, FrameOptions& frame, Renderer& renderer,
                      std::vector<float>* images);

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

using FrameDone = std::function<void(uint64_t done)>; // frames, from 1

// The images of tier exact without reuse and without caches: what every run of the path is measured against.
class ExactImages {
public:
    // Background and near plane are those of `frame`. `renderer`, `scene` and `path` must outlive this.
    ExactImages(const Scene& scene, const Path& path, const FrameOptions& frame, Renderer& renderer);

    // Would all of them take at most `budget` bytes?
    static bool fit(const Path& path, uint64_t budget);

    // Renders and keeps all of them; the renderer is not used afterwards.
    void keepAll();

    // Rendered now unless kept; then the renderer must not be the one that is measured, whose caches it would disturb.
    // Valid until the next call.
    const std::vector<float>* images(size_t shot);

private:
    void render(size_t shot, std::vector<float>* images);

    const Scene& m_scene;
    const Path& m_path;
    FrameOptions m_frame;
    Renderer& m_renderer;
    std::vector<std::vector<float>> m_kept; // kMaxEyes per shot; empty unless kept
    std::vector<float> m_current[kMaxEyes];
};

struct RunResult {
    std::vector<TimedFrame> frames;
    Accuracy accuracy;
    Tier tier = Tier::Exact; // that ran
    DeviceFacts device;      // asked for after the last timed frame
};

// Frames in order, after dropCaches(). Scoring is no part of the times. A renderer on the host is timed and
// scored in one pass, because its images are on the host anyway, a block of frames at a time; any other is timed with
// its images left on the device and renders the path again for the scores. Throws Error (Interrupted, OutOfMemory,
// Device).
RunResult measureRun(const Scene& scene, const Path& path, const FrameOptions& frame, Renderer& renderer,
                     ExactImages& exact, const ScoreOptions& score, const FrameDone& done);

} // namespace gsc
