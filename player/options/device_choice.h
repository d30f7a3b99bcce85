// SPDX-License-Identifier: Apache-2.0
// The model that is loaded and the devices that draw it.
#pragma once

#include <gsc/device.h>
#include "runtime/service/faulty_renderer.h"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace gsc {

struct ModelChoice {
    std::string file;
    bool verify = false; // check the checksum of every byte of the file before the first frame
};

// Devices that draw together, given by their number.
struct WorkerCount {
    bool given = false, all = false, on_cpu = false;
    uint32_t number = 0;
};

struct WorkerOptions {
    WorkerCount count;
    std::vector<DeviceId> devices; // devices of --devices; empty if `count` is given
    ServiceMode mode = ServiceMode::Auto;
    double min_fps = 0, max_fps = 0; // frame rates that the service keeps between; 0 = no limit
    std::optional<Faults> faults;

    // Returns true if a renderer service draws, with several devices or with the one in --devices.
    [[nodiscard]] bool several() const { return count.given || !devices.empty(); }
};

struct DeviceChoice {
    std::string backend = "auto";
    int device = 0;             // index of the device among those of the backend
    int threads = 0;            // threads of a CPU backend, 0 = all cores
    uint64_t vram_budget = 0;   // most GPU memory to use, bytes; 0 = all there is
    bool first_picture = false; // draw coarse pictures while the model is copied to the device
    WorkerOptions workers;

    [[nodiscard]] DeviceChoice of(const std::string& other) const // returns this choice with another backend
    {
        DeviceChoice choice = *this;
        choice.backend = other;
        return choice;
    }
    [[nodiscard]] DeviceChoice of(const DeviceId& other) const // returns this choice with another device
    {
        DeviceChoice choice = of(other.backend);
        choice.device = other.ordinal;
        return choice;
    }
    // returns this choice with a single device of backend `other`
    [[nodiscard]] DeviceChoice alone(const std::string& other) const
    {
        DeviceChoice choice = of(other);
        choice.workers = {};
        return choice;
    }
};

} // namespace gsc
