// SPDX-License-Identifier: Apache-2.0
// Where pictures are delivered: in memory of the host or of the first worker's device, or in that of another device once
// the first one is lost or full.
#pragma once

#include "runtime/service/pose_work.h"

namespace gsc {

// Calls are made with the service's mutex held, but for those that say so: a driver may take its time.
class DeliveryMemory {
public:
    using Pictures = std::shared_ptr<PictureMemory>;

    // Once, of a service whose first renderer that is ready draws on `ready`.
    void make(const std::vector<DeviceId>& devices, const DeviceId& ready);

    [[nodiscard]] const Pictures& of(bool on_device) const { return on_device ? m_on_device : m_on_host; }
    // Is it delivered in no more? Then nobody is to hold what leads there: a device that was lost could not begin anew.
    [[nodiscard]] bool isOld(const Pictures& pictures) const
    {
        return pictures != m_on_host && pictures != m_on_device;
    }
    void moveTo(const Pictures& pictures) { m_on_device = pictures; } // of another device

    struct Taken {
        std::shared_ptr<std::byte> memory;
        Pictures pictures; // that it is of: `from`, or those of the renderer's device
    };
    // Without the mutex. Memory for a pose that `renderer` is to draw. Throws Error (OutOfMemory, Device).
    static Taken take(const PoseWork& work, Pictures from, const Renderer& renderer);

private:
    Pictures m_on_host, m_on_device;
};

} // namespace gsc
