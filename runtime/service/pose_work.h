// SPDX-License-Identifier: Apache-2.0
// A pose from submit() to its end. Request and memory are constant while workers draw, so they are read without the
// service's mutex; all other members are read and written with it held.
#pragma once

#include "runtime/devices/device_pictures.h"
#include "runtime/service/renderer_service.h"

#include <mutex>

namespace gsc {

struct PoseWork {
    explicit PoseWork(const PoseRequest& request);
    // Copy of the pose, to be drawn anew into other memory after a fault.
    [[nodiscard]] std::shared_ptr<PoseWork> again() const;

    const PoseRequest asked;

    struct Late { // result of PoseRequest::late
        std::once_flag looked;
        std::vector<EyeParams> eyes;
        bool found = false;
    };
    std::shared_ptr<Late> late; // shared with the pose that is drawn anew

    ServiceTime submitted{0}, drawn{0};
    std::optional<ServiceTime> begun;
    SharePlan plan; // plan in force when it was begun
    uint64_t plan_serial = 0;

    // Picture of each eye, then its depths, in one block.
    size_t pixels_at[kMaxEyes] = {}, depths_at[kMaxEyes] = {}, bytes = 0;
    std::shared_ptr<std::byte> memory;
    std::shared_ptr<PictureMemory> pictures; // owner of `memory`

    struct Part {
        PosePart what;
        int worker = -1;
        double busy_ms = 0;
        FrameResult result{};
    };
    std::vector<Part> parts;
    bool drawn_anew = false;  // drawn again after a fault
    bool first_parts = false; // a part is among the first that its renderer drew, whose buffers grow

    [[nodiscard]] uint32_t eyeCount() const { return uint32_t(asked.eyes.size()); }
    [[nodiscard]] uint32_t allEyes() const { return (1u << eyeCount()) - 1; } // a bit each

    [[nodiscard]] bool isCut() const; // into bands

    void setParts(const std::vector<PosePart>& cut);
    // Result and load of all parts together, which were drawn side by side.
    [[nodiscard]] FrameResult result() const;
    [[nodiscard]] FrameLoad load() const;

    // Eyes that the pose is drawn from: the first call asks PoseRequest::late, once for all parts. Called without the
    // service's mutex.
    [[nodiscard]] std::span<const EyeParams> latestEyes() const;
    // True if all its eyes are within `distance` (world units) and `degrees` of those of `other`, with the same options.
    [[nodiscard]] bool showsSameAs(const PoseWork& other, double distance, double degrees) const;
    // Target that an eye's picture is drawn into, in a block of memory such as `memory`.
    [[nodiscard]] FrameTarget target(uint32_t eye, FrameTarget::Kind kind, std::byte* block) const;
};

} // namespace gsc
