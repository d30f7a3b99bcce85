// SPDX-License-Identifier: Apache-2.0
// Fallback to the CPU for models that a machine's better device cannot draw, if the caller leaves the choice.
#pragma once

#include <gsc/device.h>

namespace gsc {

// Returns open(asked). With "auto", if that throws for want of a device, of its memory or of its support: open({"cpu"}), after
// passOver(reason). `taken` is the device that open() has come to, or `asked`.
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
