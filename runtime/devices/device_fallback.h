// SPDX-License-Identifier: Apache-2.0
// Falls back to the CPU for a model that the machine's better device cannot draw, if the user left the choice of
// device.
#pragma once

#include <gsc/device.h>

namespace gsc {

// Returns open(asked). If "auto" was asked for and that throws because a device, its memory or its support is missing,
// calls passOver(reason) and returns open({"cpu"}). `taken` receives the device that was opened, or `asked` if open()
// threw.
template <typename Open, typename PassOver>
auto orOnCpu(const DeviceId& asked, const DeviceId& taken, const Open& open, const PassOver& passOver)
{
    try {
        return open(asked);
    } catch (const Error& e) {
        const bool of_device =
            e.code() == ErrorCode::OutOfMemory || e.code() == ErrorCode::Unsupported || e.code() == ErrorCode::Device;
        if (asked.backend != "auto" || taken.backend == "cpu" || !of_device)
            throw;
        passOver(formatString("backend %s is passed over: %s", deviceText(taken).c_str(), e.what()));
    }
    return open(DeviceId{"cpu"});
}

} // namespace gsc
