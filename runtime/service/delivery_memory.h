// SPDX-License-Identifier: Apache-2.0
// Memory that pictures are delivered in: the host's, or the first worker's device's, or another device's once the first is
// lost or full.
#pragma once

#include "runtime/service/pose_work.h"

namespace gsc {

// The service's mutex must be held, unless a function says otherwise: a driver may take its time.
class DeliveryMemory {
public:
    using Pictures = std::shared_ptr<PictureMemory>;

    // Called once, when the first renderer is ready; `ready`: its device.
    void make(const std::vector<DeviceId>& devices, const DeviceId& ready);

    [[nodiscard]] const Pictures& of(bool on_device) const { return on_device ? m_on_device : m_on_host; }
    // True if pictures are no longer delivered in this memory. Its users must then let it go, or its lost device cannot be
    // opened again.
    [[nodiscard]] bool isOld(const Pictures& pictures) const
    {
        return pictures != m_on_host && pictures != m_on_device;
    }
    void moveTo(const Pictures& pictures) { m_on_device = pictures; } // takes pictures of another device from now on

    struct Taken {
        std::shared_ptr<std::byte> memory;
        Pictures pictures; // owner of the memory: `from`, or the pictures of the renderer's device
    };
    // Takes memory for a pose that `renderer` is to draw. Called without the mutex. Throws Error (OutOfMemory, Device).
    static Taken take(const PoseWork& work, Pictures from, const Renderer& renderer);

private:
    Pictures m_on_host, m_on_device;
};

} // namespace gsc
