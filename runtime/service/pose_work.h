// SPDX-License-Identifier: Apache-2.0
// A pose of a service from submit() to its end. Request and memory do not change while workers draw, so they are read
// without the service's mutex; all other members are read and written with the mutex held.
#pragma once

#include "runtime/devices/device_pictures.h"
#include "runtime/service/renderer_service.h"

#include <mutex>

namespace gsc {

struct PoseWork {
    explicit PoseWork(const PoseRequest& request);
    // Returns a copy of the pose that will be drawn into other memory after a fault.
    [[nodiscard]] std::shared_ptr<PoseWork> again() const;

    const PoseRequest asked;

    struct Late { // the eyes that PoseRequest::late returned
        std::once_flag looked;
        std::vector<EyeParams> eyes;
        bool found = false;
    };
    std::shared_ptr<Late> late; // newer eyes of the pose; shared with the copy that is drawn after a fault

    ServiceTime submitted{0}, drawn{0};
    std::optional<ServiceTime> begun;
    SharePlan plan; // plan that applied when the pose was begun
    uint64_t plan_serial = 0;

    // Offsets in `memory` of each eye's picture and of its depths; number of all bytes.
    size_t pixels_at[kMaxEyes] = {}, depths_at[kMaxEyes] = {}, bytes = 0;
    std::shared_ptr<std::byte> memory;
    std::shared_ptr<PictureMemory> pictures; // source that `memory` was taken from

    struct Part {
        PosePart what;
        int worker = -1;
        double busy_ms = 0;
        FrameResult result{};
    };
    std::vector<Part> parts;
    bool drawn_anew = false;  // true if the pose is drawn again after a fault
    bool first_parts = false; // a part is among the first that a renderer drew, which take longer because buffers grow

    [[nodiscard]] uint32_t eyeCount() const { return uint32_t(asked.eyes.size()); }
    [[nodiscard]] uint32_t allEyes() const { return (1u << eyeCount()) - 1; } // returns the bit mask of all eyes

    [[nodiscard]] bool isCut() const; // true if the pose is cut into bands

    void setParts(const std::vector<PosePart>& cut);
    // Returns the result and the load of all parts together, which were drawn at the same time.
    [[nodiscard]] FrameResult result() const;
    [[nodiscard]] FrameLoad load() const;

    // Returns the eyes that the pose is drawn from. The first call asks PoseRequest::late, once for all parts. Called
    // without the service's mutex.
    [[nodiscard]] std::span<const EyeParams> latestEyes() const;
    // Returns true if all eyes are within `distance` (world units) and `degrees` of those of `other`, and the options
    // are equal.
    [[nodiscard]] bool showsSameAs(const PoseWork& other, double distance, double degrees) const;
    // Returns the target for an eye's picture, in a block of memory with the layout of `memory`.
    [[nodiscard]] FrameTarget target(uint32_t eye, FrameTarget::Kind kind, std::byte* block) const;
};

} // namespace gsc
