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
    bool verify = false; // the checksum of every byte before the first frame
};

// Devices that draw together, by their number.
struct WorkerCount {
    bool given = false, all = false, on_cpu = false;
    uint32_t number = 0;
};

struct WorkerOptions {
    WorkerCount count;
    std::vector<DeviceId> devices; // the devices by name; empty if a count is given
    ServiceMode mode = ServiceMode::Auto;
    double min_fps = 0, max_fps = 0; // 0 = no such limit
    std::optional<Faults> faults;

    // also true for one device in --devices
    [[nodiscard]] bool several() const { return count.given || !devices.empty(); }
};

struct DeviceChoice {
    std::string backend = "auto";
    int device = 0;             // number of the device in the backend
    int threads = 0;            // 0 = all cores
    uint64_t vram_budget = 0;   // bytes, 0 = all there is
    bool first_picture = false; // drawn while the model comes to the device
    WorkerOptions workers;

    [[nodiscard]] DeviceChoice of(const std::string& other) const // the choice for another backend
    {
        DeviceChoice choice = *this;
        choice.backend = other;
        return choice;
    }
    [[nodiscard]] DeviceChoice of(const DeviceId& other) const // the choice for another device
    {
        DeviceChoice choice = of(other.backend);
        choice.device = other.ordinal;
        return choice;
    }
    [[nodiscard]] DeviceChoice alone(const std::string& other) const // the choice for one device of that backend
    {
        DeviceChoice choice = of(other);
        choice.workers = {};
        return choice;
    }
};

} // namespace gsc
