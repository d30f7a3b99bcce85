// SPDX-License-Identifier: Apache-2.0
#include "runtime/cuda/device/nvml.h"

#include <memory>

#include <dlfcn.h>

namespace gsc {

namespace {

// Declared here, because the toolkit does not always come with nvml.h; the driver always comes with the library.
struct Memory {
    unsigned long long total, free, used; // memory of the device in bytes
};
constexpr int kClockSm = 1, kClockMemory = 2;
constexpr unsigned kVersionLength = 96;

template <typename Function>
Function* find(void* library, const char* name)
{
    return reinterpret_cast<Function*>(dlsym(library, name));
}

} // namespace

NvmlFacts nvmlFacts(const char* pci_bus_id)
{
    NvmlFacts facts;
    const auto close = [](void* library) { dlclose(library); };
    const std::unique_ptr<void, decltype(close)> library(dlopen("libnvidia-ml.so.1", RTLD_NOW | RTLD_LOCAL), close);
    if (!library)
        return facts;
    using Device = void*;
    const auto init = find<int()>(library.get(), "nvmlInit_v2");
    const auto shutdown = find<int()>(library.get(), "nvmlShutdown");
    const auto driver_version = find<int(char*, unsigned)>(library.get(), "nvmlSystemGetDriverVersion");
    const auto handle = find<int(const char*, Device*)>(library.get(), "nvmlDeviceGetHandleByPciBusId_v2");
    const auto clock = find<int(Device, int, unsigned*)>(library.get(), "nvmlDeviceGetClockInfo");
    const auto memory = find<int(Device, Memory*)>(library.get(), "nvmlDeviceGetMemoryInfo");
    if (!init || !shutdown || !driver_version || !handle || !clock || !memory || init() != 0)
        return facts;
    char version[kVersionLength] = {};
    if (driver_version(version, sizeof(version)) == 0)
        facts.driver = version;
    Device device = nullptr;
    if (handle(pci_bus_id, &device) == 0) {
        unsigned mhz = 0;
        if (clock(device, kClockSm, &mhz) == 0)
            facts.clock_mhz = mhz;
        if (clock(device, kClockMemory, &mhz) == 0)
            facts.memory_clock_mhz = mhz;
        Memory bytes{};
        if (memory(device, &bytes) == 0)
            facts.used_bytes = bytes.used;
    }
    shutdown();
    return facts;
}

} // namespace gsc
