// SPDX-License-Identifier: Apache-2.0
// Takes poses, returns the newest finished pictures: the window's access to the renderer service.
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

// A pose and the options that it was asked for with.
struct AskedPose {
    Shot shot;
    uint32_t eyes = 1;
    PixelFormat format = PixelFormat::Rgba8;
    bool wants_depth = false;                         // deliver depths, and the picture, in memory of the host
    float gaze[kMaxEyes][2] = {};                     // Foveation's
    LensShape lens[kMaxEyes];                         // FrameOptions'
    float lod_bias = 0, detail = 0, fovea_pixels = 0; // FrameOptions' that it was submitted with
    // PoseRequest::late of the cameras in `shot`; may be empty.
    std::function<bool(Shot& shot)> late{};
};

struct DrawnPose {
    AskedPose asked;
    Delivery delivery;

    [[nodiscard]] double latencyMs() const;
};

class FrameSource {
public:
    // Pictures come in memory that the display shares with the first device, or else in that of this process. `opened` is
    // what openService() made of the same scene and options. Throws Error(Device).
    FrameSource(std::shared_ptr<const Scene> scene, const ModelChoice& model, const DeviceChoice& choice,
                SharedMemory& memory, OpenedService opened);
    ~FrameSource();

    // Submits a pose without waiting, and returns its number. Throws Error(Usage) for a pose that cannot be drawn.
    uint64_t submit(const AskedPose& pose, const FrameOptions& options);
    // Waits at most so long. A failed pose, which only a service that keeps all delivers, has an error and no
    // picture. Throws Error(Device) where no worker is left.
    std::optional<DrawnPose> next(std::chrono::nanoseconds most);

    // Pictures of a pose for the display, side by side. Pictures on a GPU are handed over, once for each pose; the
    // caller keeps the poses of the last two frames. Empty if the GPU is lost: from then on pictures come in memory of
    // this process, and the pose must be submitted again.
    [[nodiscard]] std::vector<ShownPicture> shown(const DrawnPose& drawn);

    // The service, whose end may take long; nothing but the destructor may be called after this.
    OpenedService release() { return std::move(m_opened); }

    [[nodiscard]] bool waiting() const { return !m_open.empty(); } // true while a pose is open
    [[nodiscard]] ServiceStats stats() const { return m_opened.service->stats(); }
    [[nodiscard]] bool drawsDetail(const FrameChoice& choice) const; // player/frames/lod_target.h
    [[nodiscard]] std::string device() const { return m_opened.service->device().name; }

private:
    std::shared_ptr<const Scene> m_scene;
    OpenedService m_opened;
    std::map<uint64_t, AskedPose> m_open;
    const std::string m_input;
    std::unique_ptr<HandOverRing> m_ring; // null: pictures come in memory of this process
    std::vector<ShownPicture> m_handed;   // pictures of the pose that was handed over last
    uint64_t m_handed_pose = 0;
};

} // namespace gsc
