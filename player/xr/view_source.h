// SPDX-License-Identifier: Apache-2.0
// Submits all views of a headset and returns the newest finished pictures. A FrameSource draws one or two eyes at a
// time, so four views are two pairs; a frame is finished when all its pairs are.
#pragma once

#include "player/devices/frame_source.h"
#include "player/xr/late_eyes.h"
#include "player/poses/placement.h"

#include <future>

namespace gsc {

// Eyes of a frame as located, and the cameras of each pair of views.
struct AskedViews {
    uint64_t frame = 0; // number of the headset's frame in which the eyes were located
    // display time of that frame; display time that the eyes were predicted for; OpenXR's clock, ns
    int64_t shown_at = 0, time = 0;
    double metre = 1; // world units in a metre of the space when the eyes were located
    std::vector<SpaceEye> eyes;
    std::vector<std::array<float, 2>> gaze; // gazeOf() each eye; empty = not known
    std::vector<AskedPose> pairs;
    std::shared_ptr<LateLook> late; // the eyes that --xr-late locates; null: the option was not given
};

struct DrawnViews {
    AskedViews asked;
    std::vector<DrawnPose> pairs;
};

class ViewSource {
public:
    // `waits`: every frame is drawn, in order, and a failed frame is an error. While renewing(), only the thread that
    // opens the new renderer may use `log`. Throws Error.
    ViewSource(std::shared_ptr<const Scene> scene, const ModelChoice& model, const DeviceChoice& choice,
               SharedMemory& memory, bool waits, size_t views, Reporter& log);

    // Submits views without waiting. Returns false if none can be taken now: a new renderer is being opened, or more
    // than two views are still being drawn. Throws Error(Usage) for views that cannot be drawn.
    bool submit(AskedViews views, const FrameOptions& options);
    // Returns the newest finished views; waits up to `most` for some. If no worker is left, a new renderer is opened
    // while the caller continues. Throws Error(Device) after kTries new renderers in a row without a picture.
    std::optional<DrawnViews> next(std::chrono::nanoseconds most);
    // Returns one picture for each view. Precondition: the display no longer reads the pictures of the frame before.
    [[nodiscard]] std::vector<ShownPicture> shown(const DrawnViews& drawn);

    // Returns FrameSource::drawsDetail(). Precondition: !renewing().
    [[nodiscard]] bool drawsDetail(const FrameChoice& choice) const { return m_source->drawsDetail(choice); }
    // true while a new renderer is being opened; the caller must not use `log`
    [[nodiscard]] bool renewing() const { return m_opening.valid(); }
    [[nodiscard]] bool waiting() const { return !m_open.empty() || m_opening.valid(); }
    [[nodiscard]] std::optional<ServiceStats> stats() const; // numbers of the current renderer's service
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
    std::unique_ptr<FrameSource> m_source; // null while a new renderer is being opened
    std::future<OpenedService> m_opening;
    std::map<uint64_t, Open> m_open; // key: number of a frame's last pose
    std::optional<DrawnViews> m_newest;
    int m_tries = 0;
    uint64_t m_renewals = 0;
};

} // namespace gsc
