// SPDX-License-Identifier: Apache-2.0
// The devices that a renderer can be made for, and the facts of a device that belong to a measurement.
#pragma once

#include <gsc/error.h>

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace gsc {

// Name of a device. The backend "auto" stands for the best that the machine can run.
struct DeviceId {
    std::string backend = "auto"; // cuda, cpu, cpu-reference or auto
    int ordinal = 0;              // index among the backend's devices; a CPU is one device

    bool operator==(const DeviceId&) const = default;
};

// Returns the name of a device for reports and messages: "cuda:0", "cpu".
std::string deviceText(const DeviceId& device);

struct DeviceInfo {
    DeviceId id;
    bool usable = false;
    // why the device is not usable: Device (no such device or driver) or Unsupported (no code for it); none = usable
    std::optional<Error> fault;
    std::string text;          // description of a usable device, else the fault and its remedy
    std::string name = {};     // name of a usable GPU; empty for others
    uint64_t memory_bytes = 0; // memory of the device's own, bytes; 0 = it uses the host's
};

// Returns the names of all backends of this build, the best first, usable or not.
std::vector<std::string> backendNames();

// Returns how pictures are copied from one GPU to another: "NVLink", "PCIe" (both directly) or "host" (through host
// memory).
std::string deviceLink(const DeviceId& from, const DeviceId& to);

// Returns every device of every backend of this build, the best first. A backend without a device is in the list once,
// with the reason.
std::vector<DeviceInfo> devices();

// Returns the best device that this machine can run, if the backend of `asked` is "auto"; its ordinal is used for each
// backend. `passOver` is called with each device that is passed over, and the reason; a kind of device that the machine
// does not have is none. Returns `asked` itself otherwise, and if no device can be used: makeRenderer() then says why.
DeviceId bestDevice(const DeviceId& asked, const std::function<void(const std::string&)>& passOver = {});

// Starts a device, or the best one for "auto", which takes some tenths of a second for a GPU and which makeRenderer()
// would do otherwise. Never throws: makeRenderer() says why a device cannot be used.
void startDevice(const DeviceId& device) noexcept;

// Throws Error(Usage) for a backend or device that does not exist, naming those that do. A device that exists may
// still be unusable.
void checkDevice(const DeviceId& device);

// Throws as makeRenderer() does if a device exists but is not usable. Never throws for "auto".
void checkUsable(const DeviceId& device);

// Facts of a device; empty or 0 = unknown.
struct DeviceFacts {
    std::string name, driver;
    uint64_t memory_bytes = 0;
    uint32_t processors = 0;                    // multiprocessors of a GPU; threads of a CPU
    double clock_mhz = 0, memory_clock_mhz = 0; // clock rates at the moment of asking
    uint64_t context_bytes = 0;                 // device memory that the driver takes for this process, bytes
};

// The highest rate of each kind of work on a device, each measured alone. A multiply-add counts as one lane operation
// and as two FLOP.
struct DeviceCeilings {
    double copy_bytes_per_s = 0;   // rate of copying within device memory, counted as bytes read plus bytes written
    double read_bytes_per_s = 0;   // rate of reading device memory
    double fma_lane_ops_per_s = 0; // rate of multiply-adds in fp32, in lane operations
    double mma_flop_per_s = 0;     // rate of the matrix units (mma.sync) with factors in fp16 and sums in fp32
    double exp_per_s = 0;          // rate of approximate exponentials to base 2

    [[nodiscard]] bool known() const { return copy_bytes_per_s > 0; } // true if the rates have been measured
};

} // namespace gsc
