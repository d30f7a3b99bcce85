// SPDX-License-Identifier: Apache-2.0
#include <gsc/error.h>
#include "runtime/cpu/renderer_cpu.h"
#include "runtime/devices/graphics_card.h"
#include <gsc/renderer.h>
#if defined(GSC_HAVE_CUDA)
#include "runtime/cuda/picture_cuda.h"
#include "runtime/cuda/renderer_cuda.h"
#endif

#include <algorithm>

namespace gsc {

namespace {

struct Entry {
    const char* name;
    int (*count)();     // function that returns the number of devices that can be used
    bool (*is_there)(); // true if the machine has such a device, usable or not
    DeviceInfo (*look)(int ordinal);
    std::unique_ptr<Renderer> (*make)(int ordinal, const RendererOptions& options);
};

int one()
{
    return 1;
}

bool always()
{
    return true;
}

DeviceInfo allCores(int)
{
    return {{"cpu", 0}, true, {}, "all cores, SIMD chosen at run time"};
}

DeviceInfo oneCore(int)
{
    return {{"cpu-reference", 0}, true, {}, "scalar, one thread; slow, for comparison"};
}

// Backends of this build, the best first. A new backend is added here, under the macro that says that it was built.
constexpr Entry kEntries[] = {
#if defined(GSC_HAVE_CUDA)
    {"cuda", cudaDeviceCount, [] { return hasGraphicsCard(kNvidia); }, lookAtCudaDevice, makeCudaRenderer},
#endif
    {"cpu", one, always, allCores,
     [](int, const RendererOptions& options) { return makeCpuRenderer(CpuPath::Fast, options.threads); }},
    {"cpu-reference", one, always, oneCore,
     [](int, const RendererOptions&) { return makeCpuRenderer(CpuPath::Reference, 1); }},
};

Error unusable(const DeviceInfo& device)
{
    return device.fault->about("backend " + deviceText(device.id));
}

// Calls passOver() with a device that "auto" cannot use. A machine without such a device has no fault to tell.
template <typename PassOver>
void passOverDevice(const Entry& entry, const DeviceInfo& device, const PassOver& passOver)
{
    if (entry.is_there() || entry.count() > 0)
        passOver(formatString("backend %s is passed over: %s", deviceText(device.id).c_str(), device.text.c_str()));
}

} // namespace

std::string deviceText(const DeviceId& device)
{
    const bool only_one = device.backend == "auto" || device.backend.starts_with("cpu");
    return only_one && device.ordinal == 0 ? device.backend : device.backend + ":" + std::to_string(device.ordinal);
}

DeviceId bestDevice(const DeviceId& asked, const std::function<void(const std::string&)>& passOver)
{
    for (const Entry& entry : kEntries) {
        if (asked.backend != "auto" || (asked.ordinal != 0 && asked.ordinal >= entry.count()))
            continue;
        const DeviceInfo found = entry.look(asked.ordinal);
        if (found.usable)
            return found.id;
        if (passOver)
            passOverDevice(entry, found, passOver);
    }
    return asked;
}

std::vector<std::string> backendNames()
{
    std::vector<std::string> names;
    for (const Entry& entry : kEntries)
        names.emplace_back(entry.name);
    return names;
}

std::vector<DeviceInfo> devices()
{
    std::vector<DeviceInfo> all;
    for (const Entry& entry : kEntries)
        for (int i = 0; i < std::max(1, entry.count()); ++i)
            all.push_back(entry.look(i));
    return all;
}

std::string deviceLink([[maybe_unused]] const DeviceId& from, [[maybe_unused]] const DeviceId& to)
{
#if defined(GSC_HAVE_CUDA)
    if (from.backend == "cuda" && to.backend == "cuda")
        return cudaLink(from.ordinal, to.ordinal);
#endif
    return "host";
}

void checkDevice(const DeviceId& device)
{
    const bool any = device.backend == "auto";
    std::string names = "auto";
    for (const Entry& entry : kEntries) {
        names += std::string(", ") + entry.name;
        if (!any && device.backend != entry.name)
            continue;
        const int count = entry.count();
        if (device.ordinal == 0 || (device.ordinal > 0 && device.ordinal < count))
            return;
        if (!any)
            throw Error(ErrorCode::Usage, "backend " + deviceText(device),
                        formatString("this machine has %d of its devices", count), "a number below that",
                        "look at the list of devices")
                .with({Setting::DeviceList});
    }
    if (any)
        throw Error(ErrorCode::Usage, formatString("device %d", device.ordinal), "no backend of this machine has it",
                    "the number of one that there is", "look at the list of devices")
            .with({Setting::DeviceList});
    throw Error(ErrorCode::Usage, "backend " + device.backend, "not part of this build", "one of " + names,
                "choose one of those");
}

void checkUsable(const DeviceId& device)
{
    for (const Entry& entry : kEntries)
        if (device.backend == entry.name)
            if (const DeviceInfo found = entry.look(device.ordinal); !found.usable)
                throw unusable(found);
}

void startDevice(const DeviceId& device) noexcept
try {
    for (const Entry& entry : kEntries)
        if ((device.backend == "auto" || device.backend == entry.name) && device.ordinal >= 0 &&
            device.ordinal < entry.count() && entry.look(device.ordinal).usable)
            return;
} catch (...) {
}

std::unique_ptr<Renderer> makeRenderer(const DeviceId& device, const RendererOptions& options, std::string* warning)
{
    checkDevice(device);
    const bool any = device.backend == "auto";
    DeviceInfo found;
    for (const Entry& entry : kEntries) {
        if ((!any && device.backend != entry.name) || (any && device.ordinal != 0 && device.ordinal >= entry.count()))
            continue;
        found = entry.look(device.ordinal);
        if (found.usable)
            return entry.make(device.ordinal, options);
        if (any && warning != nullptr)
            passOverDevice(entry, found, [warning](const std::string& why) { *warning = why; });
    }
    throw unusable(found);
}

} // namespace gsc
