// SPDX-License-Identifier: Apache-2.0
// Graphics cards of the machine, whether or not their drivers work.
#pragma once

#include <cstdint>
#include <string>

namespace gsc {

constexpr uint32_t kNvidia = 0x10de; // PCI number of the vendor

// True if a PCI device of a vendor is a display controller, or a driver of NVIDIA or of Windows (WSL) has made a file for
// a card. `devices` is the folder in which Linux lists PCI devices, `files` the one of such files.
bool hasGraphicsCard(uint32_t vendor, const std::string& devices = "/sys/bus/pci/devices",
                     const std::string& files = "/dev");

} // namespace gsc
