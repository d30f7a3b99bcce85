// SPDX-License-Identifier: Apache-2.0
// Takes all views of a headset, returns their newest finished pictures. FrameSource draws one or two eyes at a time, so four
// views are two pairs, and a frame is finished when all its pairs are.
#pragma once

#include "player/devices/frame_source.h"
#include "player/xr/late_eyes.h"
#include "player/poses/placement.h"

#include <future>

namespace gsc {

// Located eyes of a frame, and the cameras of each pair.
struct AskedViews {
    uint64_t frame = 0;             // frame of the headset in which the eyes were located
    int64_t shown_at = 0, time = 0; // display time of that frame; time that the eyes were predicted for
    double metre = 1;               // world units per metre of the space at that time
    std::vector<SpaceEye> eyes;
    std::vector<std::array<float, 2>> gaze; // direction of each eye's gaze, if known
    std::vector<AskedPose> pairs;
    std::shared_ptr<LateLook> late; // result of --xr-late; null: not asked for
};

struct DrawnViews {
    AskedViews asked;
    std::vector<DrawnPose> pairs;
};

class ViewSource {
public:
    // `waits`: every frame is drawn, in order, and a frame that fails is an error. While a renderer is made anew, only the
    // thread that makes it may use `log`. Throws Error.
    ViewSource(std::shared_ptr<const Scene> scene, const ModelChoice& model, const DeviceChoice& choice,
               SharedMemory& memory, bool waits, size_t views, Reporter& log);

    // Submits views, without waiting. Returns false if it takes none now: the renderer is being made anew, or more than two
    // views are still being drawn. Throws Error(Usage) for views that cannot be drawn.
    bool submit(AskedViews views, const FrameOptions& options);
    // Returns the newest finished views; waits at most so long for some. If no worker is left, a renderer is made anew while
    // the caller continues, up to kTries times without a picture between them; then throws Error(Device).
    std::optional<DrawnViews> next(std::chrono::nanoseconds most);
    // One picture for each view. Pictures of the frame before are no longer read.
    [[nodiscard]] std::vector<ShownPicture> shown(const DrawnViews& drawn);

    // FrameSource::drawsDetail(). Precondition: !renewing().
    [[nodiscard]] bool drawsDetail(const FrameChoice& choice) const { return m_source->drawsDetail(choice); }
    [[nodiscard]] bool renewing() const { return m_opening.valid(); } // the caller must not use `log`
    [[nodiscard]] bool waiting() const { return !m_open.empty() || m_opening.valid(); }
    [[nodiscard]] std::optional<ServiceStats> stats() const; // numbers of the current renderer
    [[nodiscard]] uint64_t renewals() const { return m_renewals; }

private:
    struct Open {
        DrawnViews views;
        std::exception_ptr error;
    };

    [[nodiscard]] std::function<OpenedService()> opener() const;
    void renew(const Error& why);
    void take(DrawnPose drawn);

    static constexpr int kTries = 3;

    std::shared_ptr<const Scene> m_scene;
    ModelChoice m_model;
    DeviceChoice m_choice;
    SharedMemory& m_memory;
    bool m_waits, m_keeps_all;
    Reporter& m_log;
    std::unique_ptr<FrameSource> m_source; // null while it is being made anew
    std::future<OpenedService> m_opening;
    std::map<uint64_t, Open> m_open; // key: last pose of a frame
    std::optional<DrawnViews> m_newest;
    int m_tries = 0;
    uint64_t m_renewals = 0;
};

} // namespace gsc
