// SPDX-License-Identifier: Apache-2.0
// Access of the window to the renderer service: submits poses and returns the newest finished pictures.
#pragma once

#include "player/present/hand_over_ring.h"
#include "player/frames/shots.h"
#include "player/devices/open_service.h"
#include "runtime/service/renderer_service.h"

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace gsc {

// A pose and the options that it was submitted with.
struct AskedPose {
    Shot shot;
    uint32_t eyes = 1;
    PixelFormat format = PixelFormat::Rgba8;
    bool wants_depth = false;                         // the service delivers depths too, and both in memory of the host
    float gaze[kMaxEyes][2] = {};                     // direction of each eye's gaze, Foveation::gaze
    LensShape lens[kMaxEyes];                         // visible part of each eye's picture, FrameOptions::lens
    float lod_bias = 0, detail = 0, fovea_pixels = 0; // values of FrameOptions for this pose
    // Function that gives `shot` newer cameras just before it is drawn, as PoseRequest::late does; returns true if it
    // did. May be empty.
    std::function<bool(Shot& shot)> late{};
};

struct DrawnPose {
    AskedPose asked;
    Delivery delivery;

    [[nodiscard]] double latencyMs() const;
};

class FrameSource {
public:
    // Pictures come in memory that the display shares with the first device, or else in memory of this process.
    // `opened` is the result of openService() for the same scene and options. Throws Error(Device).
    FrameSource(std::shared_ptr<const Scene> scene, const ModelChoice& model, const DeviceChoice& choice,
                SharedMemory& memory, OpenedService opened);
    ~FrameSource();

    // Submits a pose without waiting and returns the number of the pose. Throws Error(Usage) for a pose that cannot be
    // drawn.
    uint64_t submit(const AskedPose& pose, const FrameOptions& options);
    // Waits up to `most` for the next finished pose; returns none if none is finished by then. A failed pose, which is
    // returned only by a service that keeps all poses, has an error and no picture. Throws Error(Device) if no worker
    // is left.
    std::optional<DrawnPose> next(std::chrono::nanoseconds most);

    // Returns the pictures of a pose for the display, one for each eye, placed side by side. Pictures on a GPU are
    // handed over once for each pose; the caller keeps the poses of the last two frames alive. Returns an empty list
    // if the GPU is lost: from then on pictures come in memory of this process, and the pose must be submitted again.
    [[nodiscard]] std::vector<ShownPicture> shown(const DrawnPose& drawn);

    // Hands over the service, because ending it may take long. Only the destructor may be called after this.
    OpenedService release() { return std::move(m_opened); }

    [[nodiscard]] bool waiting() const { return !m_open.empty(); } // true while a submitted pose is not finished
    [[nodiscard]] ServiceStats stats() const { return m_opened.service->stats(); }
    // drawsDetail() of player/frames/lod_target.h for this service
    [[nodiscard]] bool drawsDetail(const FrameChoice& choice) const;
    [[nodiscard]] std::string device() const { return m_opened.service->device().name; }

private:
    std::shared_ptr<const Scene> m_scene;
    OpenedService m_opened;
    std::map<uint64_t, AskedPose> m_open;
    const std::string m_input;
    // shares memory with the display; null: pictures come in memory of this process
    std::unique_ptr<HandOverRing> m_ring;
    std::vector<ShownPicture> m_handed; // pictures of the pose that was handed over to the display last
    uint64_t m_handed_pose = 0;
};

} // namespace gsc
