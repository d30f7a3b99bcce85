// SPDX-License-Identifier: Apache-2.0
// The memory in which pictures are delivered: of the host, or of the first worker's device, or of another device once
// the first is lost or full.
#pragma once

#include "runtime/service/pose_work.h"

namespace gsc {

// The service's mutex must be held, unless a function says otherwise: calls of a driver may take long.
class DeliveryMemory {
public:
    using Pictures = std::shared_ptr<PictureMemory>;

    // Makes the memories; called once, when the first renderer is ready on device `ready`.
    void make(const std::vector<DeviceId>& devices, const DeviceId& ready);

    [[nodiscard]] const Pictures& of(bool on_device) const { return on_device ? m_on_device : m_on_host; }
    // Returns true if pictures are no longer delivered in this memory. Whoever uses it must then release it: otherwise
    // its lost device cannot be opened again.
    [[nodiscard]] bool isOld(const Pictures& pictures) const
    {
        return pictures != m_on_host && pictures != m_on_device;
    }
    void moveTo(const Pictures& pictures) { m_on_device = pictures; } // delivers in another device's memory from now on

    struct Taken {
        std::shared_ptr<std::byte> memory;
        Pictures pictures; // owner of the memory: `from`, or that of the renderer's device
    };
    // Takes memory for a pose that `renderer` will draw. Called without the mutex. Throws Error (OutOfMemory, Device).
    static Taken take(const PoseWork& work, Pictures from, const Renderer& renderer);

private:
    Pictures m_on_host, m_on_device;
};

} // namespace gsc
