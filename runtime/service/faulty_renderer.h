// SPDX-License-Identifier: Apache-2.0
// Makes renderers that fail on purpose, to test how a service handles faults.
#pragma once

#include "runtime/service/renderer_service.h"

namespace gsc {

// Probabilities that a fault happens in a frame; their sum is at most 1.
struct Faults {
    double throws = 0; // the frame throws an exception that is no Error
    double hangs = 0;  // wait() hangs: it does not return for the time `hang`
    double lost = 0;   // the device is lost: Error(Device) in this frame and all later ones
    double memory = 0; // the frame throws Error(OutOfMemory)
    ServiceTime hang{std::chrono::seconds(1)};
    ServiceTime slow{0};            // time that is added to every frame
    uint64_t seed = 1;              // if one thread draws, equal seeds give equal faults to equal frames
    std::optional<DeviceId> device; // only this device has faults; none = all devices have

    [[nodiscard]] bool any() const { return throws > 0 || hangs > 0 || lost > 0 || memory > 0 || slow.count() > 0; }
};

// Wraps `make` (empty = makeRenderer()), so that its renderers have faults. The result may be called from several
// threads.
MakeRenderer withFaults(const Faults& faults, MakeRenderer make = {});

} // namespace gsc
