// SPDX-License-Identifier: Apache-2.0
// The devices that a renderer can be made for, and the facts of a device that a measurement must state.
#pragma once

#include <gsc/error.h>

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace gsc {

// "auto" is the best that the machine can run.
struct DeviceId {
    std::string backend = "auto"; // cuda, cpu, cpu-reference or auto
    int ordinal = 0;              // among the backend's devices; a CPU is one

    bool operator==(const DeviceId&) const = default;
};

// The one name of a device, in reports and messages: "cuda:0", "cpu".
std::string deviceText(const DeviceId& device);

struct DeviceInfo {
    DeviceId id;
    bool usable = false;
    std::optional<Error> fault; // why it is not usable: Device, no such device or driver; Unsupported, no code for it
    std::string text;           // usable: description of the device; otherwise the fault and its remedy
    std::string name = {};      // name of a usable GPU
    uint64_t memory_bytes = 0;  // the device's own memory; 0 = it uses the host's
};

// Names of this build's backends, best first, usable or not.
std::vector<std::string> backendNames();

// How pictures come from one GPU to another: "NVLink", "PCIe" (both from memory to memory) or "host" (through its memory).
std::string deviceLink(const DeviceId& from, const DeviceId& to);

// Every device of every backend of this build, best first; a backend without a device once, with the reason.
std::vector<DeviceInfo> devices();

// The best device that this machine can run, if `asked` is "auto"; of the ordinal asked for. `passOver` is told which
// device is passed over and why. `asked` itself otherwise, and where there is none: makeRenderer() says why.
DeviceId bestDevice(const DeviceId& asked, const std::function<void(const std::string&)>& passOver = {});

// Starts a device, or the best that "auto" finds, which takes a GPU some tenths of a second; makeRenderer() would.
// Never throws: makeRenderer() says why a device cannot be used.
void startDevice(const DeviceId& device) noexcept;

// Throws Error(Usage) for a backend or device that does not exist, naming those that do. An existing one may still not
// be usable.
void checkDevice(const DeviceId& device);

// Throws as makeRenderer() for a device that exists and is not usable; never for "auto".
void checkUsable(const DeviceId& device);

// Empty or 0 = unknown.
struct DeviceFacts {
    std::string name, driver;
    uint64_t memory_bytes = 0;
    uint32_t processors = 0;                    // multiprocessors of a GPU, threads of a CPU
    double clock_mhz = 0, memory_clock_mhz = 0; // at the moment of asking
    uint64_t context_bytes = 0;                 // device memory that the driver takes for this process
};

// The most of each kind of work that a device does, each measured alone. A multiply-add is one lane operation and two
// FLOP.
struct DeviceCeilings {
    double copy_bytes_per_s = 0;   // device memory, bytes read and bytes written together
    double read_bytes_per_s = 0;   // device memory
    double fma_lane_ops_per_s = 0; // fp32
    double mma_flop_per_s = 0;     // matrix units through mma.sync, factors of fp16 and sums of fp32
    double exp_per_s = 0;          // base 2, approximate

    [[nodiscard]] bool known() const { return copy_bytes_per_s > 0; } // then all are
};

} // namespace gsc
