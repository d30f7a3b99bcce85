// SPDX-License-Identifier: Apache-2.0
// A renderer that fails on purpose, to test how a service handles faults.
#pragma once

#include "runtime/service/renderer_service.h"

namespace gsc {

// Chances of faults per frame; their sum is 0 to 1.
struct Faults {
    double throws = 0; // an exception that is no Error
    double hangs = 0;  // wait() does not return for `hang`
    double lost = 0;   // the device is lost: Error(Device), from then on
    double memory = 0; // Error(OutOfMemory)
    ServiceTime hang{std::chrono::seconds(1)};
    ServiceTime slow{0};            // added to the time of every frame
    uint64_t seed = 1;              // equal seeds give equal faults to equal frames, where one thread draws
    std::optional<DeviceId> device; // the only device that faults; none = all do

    [[nodiscard]] bool any() const { return throws > 0 || hangs > 0 || lost > 0 || memory > 0 || slow.count() > 0; }
};

// Wraps `make` (empty = makeRenderer()): its renderers have faults. The result may be called from several threads.
MakeRenderer withFaults(const Faults& faults, MakeRenderer make = {});

} // namespace gsc
