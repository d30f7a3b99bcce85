// SPDX-License-Identifier: Apache-2.0
// All views of a headset in, their newest finished pictures out. FrameSource draws one or two eyes at a time, so four views
// are two pairs, and a frame is there when all its pairs are.
#pragma once

#include "player/devices/frame_source.h"
#include "player/xr/late_eyes.h"
#include "player/poses/placement.h"

#include <future>

namespace gsc {

// Eyes as they were located, and the cameras of each pair.
struct AskedViews {
    uint64_t frame = 0;             // of the headset, in which they were located
    int64_t shown_at = 0, time = 0; // when that frame was to be seen; that they were located for
    double metre = 1;               // world units, as the space lay then
    std::vector<SpaceEye> eyes;
    std::vector<std::array<float, 2>> gaze; // of each, if known
    std::vector<AskedPose> pairs;
    std::shared_ptr<LateLook> late; // null: the eyes are those that were located
};

struct DrawnViews {
    AskedViews asked;
    std::vector<DrawnPose> pairs;
};

class ViewSource {
public:
    // `waits`: every frame is drawn, in order, and one that cannot be is an error. While a renderer is made anew, `log` belongs
    // to the thread that does so. Throws Error.
    ViewSource(std::shared_ptr<const Scene> scene, const ModelChoice& model, const DeviceChoice& choice,
               SharedMemory& memory, bool waits, size_t views, Reporter& log);

    // Does not wait. False where it takes none now: the renderer is being made anew, or more than two views are still being
    // drawn. Throws Error(Usage) for what cannot be drawn.
    bool submit(AskedViews views, const FrameOptions& options);
    // The newest that is there; waits for one at most so long. A renderer of which no worker is left is made anew while the
    // caller goes on, kTries times without a picture between; then throws Error(Device).
    std::optional<DrawnViews> next(std::chrono::nanoseconds most);
    // One picture for each view. Those of the frame before are not read any more.
    [[nodiscard]] std::vector<ShownPicture> shown(const DrawnViews& drawn);

    // FrameSource's. Precondition: !renewing().
    [[nodiscard]] bool drawsDetail(const FrameChoice& choice) const { return m_source->drawsDetail(choice); }
    [[nodiscard]] bool renewing() const { return m_opening.valid(); } // `log` is not the caller's
    [[nodiscard]] bool waiting() const { return !m_open.empty() || m_opening.valid(); }
    [[nodiscard]] std::optional<ServiceStats> stats() const; // of the renderer there is
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
    std::map<uint64_t, Open> m_open; // by the last pose of a frame
    std::optional<DrawnViews> m_newest;
    int m_tries = 0;
    uint64_t m_renewals = 0;
};

} // namespace gsc
