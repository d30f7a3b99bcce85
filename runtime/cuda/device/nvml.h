// SPDX-License-Identifier: Apache-2.0
// Facts from the driver's management library (NVML) that CUDA does not tell: driver version, clocks, memory in use.
#pragma once

#include <cstdint>
#include <string>

namespace gsc {

struct NvmlFacts {
    std::string driver;                         // version such as 570.124.06; empty if the library is missing
    double clock_mhz = 0, memory_clock_mhz = 0; // clocks at this moment; 0 = unknown
    uint64_t used_bytes = 0; // device memory in use by all processes at this moment, bytes; 0 = unknown
};

// Returns the facts of a device. `pci_bus_id` is a text from cudaDeviceGetPCIBusId(). Never throws: without the
// library nothing is known.
NvmlFacts nvmlFacts(const char* pci_bus_id);

} // namespace gsc
