// SPDX-License-Identifier: Apache-2.0
// A renderer that fails on purpose, so that what a service does about it can be tried.
#pragma once

#include "runtime/service/renderer_service.h"

namespace gsc {

// Chances for each frame, 0 to 1 together.
struct Faults {
    double throws = 0; // an exception that nobody expects
    double hangs = 0;  // wait() does not return for `hang`
    double lost = 0;   // the device is lost: Error(Device), from then on
    double memory = 0; // Error(OutOfMemory)
    ServiceTime hang{std::chrono::seconds(1)};
    ServiceTime slow{0};            // that every frame takes longer
    uint64_t seed = 1;              // of the same faults for the same frames, where one thread draws
    std::optional<DeviceId> device; // of which only; none = of all

    [[nodiscard]] bool any() const { return throws > 0 || hangs > 0 || lost > 0 || memory > 0 || slow.count() > 0; }
};

// Makes what `make` makes (empty = makeRenderer()), with faults. May be called from several threads.
MakeRenderer withFaults(const Faults& faults, MakeRenderer make = {});

} // namespace gsc
