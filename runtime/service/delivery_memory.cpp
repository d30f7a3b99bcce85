// SPDX-License-Identifier: Apache-2.0
#include "runtime/service/delivery_memory.h"

#include <gsc/error.h>

#include <algorithm>

namespace gsc {

void DeliveryMemory::make(const std::vector<DeviceId>& devices, const DeviceId& ready)
{
    const bool any_gpu =
        std::ranges::any_of(devices, [](const DeviceId& device) { return !device.backend.starts_with("cpu"); });
    m_on_host = hostPictures(any_gpu);
    m_on_device = devicePictures(devices.front().backend == "auto" ? ready : devices.front());
}

// Takes memory for a pose's pictures. If the device is lost or full, they are delivered in memory of this worker's
// device.
DeliveryMemory::Taken DeliveryMemory::take(const PoseWork& work, Pictures from, const Renderer& renderer)
{
    try {
        return {from->take(work.bytes), from};
    } catch (const Error& e) {
        const bool is_theirs = e.code() == ErrorCode::Device || e.code() == ErrorCode::OutOfMemory;
        if (!work.asked.on_device || !is_theirs || from->takesFrom(renderer))
            throw;
    }
    const Pictures own = devicePictures(renderer.id());
    return {own->take(work.bytes), own};
}

} // namespace gsc
