// SPDX-License-Identifier: Apache-2.0
#include "runtime/devices/graphics_card.h"

#include <cstdlib>
#include <filesystem>
#include <fstream>

namespace gsc {

namespace {

constexpr uint32_t kDisplayController = 0x03; // class of a PCI device: the highest of its three bytes

// Number in a file such as "0x10de"; 0 if it cannot be read.
uint32_t numberIn(const std::filesystem::path& file)
{
    std::string text;
    std::ifstream(file) >> text;
    return uint32_t(std::strtoul(text.c_str(), nullptr, 16));
}

} // namespace

bool hasGraphicsCard(uint32_t vendor, const std::string& devices, const std::string& files)
{
    std::error_code code;
    if (vendor == kNvidia) // containers and WSL may list no PCI devices
        for (const char* const file : {"nvidia0", "dxg"})
            if (std::filesystem::exists(std::filesystem::path(files) / file, code))
                return true;
    for (std::filesystem::directory_iterator entry(devices, code), end; !code && entry != end; entry.increment(code))
        if (numberIn(entry->path() / "vendor") == vendor &&
            numberIn(entry->path() / "class") >> 16 == kDisplayController)
            return true;
    return false;
}

} // namespace gsc
