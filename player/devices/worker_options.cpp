// SPDX-License-Identifier: Apache-2.0
#include "player/devices/worker_options.h"

#include <gsc/error.h>
#include "format/machine/machine.h"
#include "runtime/cli/json.h"
#include "runtime/cli/version.h"
#include "runtime/service/faulty_renderer.h"

#include <algorithm>
#include <utility>

namespace gsc {

namespace {

// Returns as many devices of this machine as `count` asks for.
std::vector<DeviceId> devicesOf(const WorkerCount& count)
{
    if (count.on_cpu)
        return std::vector<DeviceId>(count.number, DeviceId{"cpu"});
    std::vector<DeviceId> found;
    std::string why = "this build has no backend for GPUs";
    for (const DeviceInfo& device : devices())
        if (device.id.backend == "cuda") {
            why = device.text;
            if (device.usable)
                found.push_back(device.id);
        }
    if (found.empty())
        throw Error(ErrorCode::Device, "--gpus", "no GPU can be used (" + why + ")", "one", "take --gpus cpu:N");
    if (!count.all && found.size() < count.number)
        throw Error(ErrorCode::Usage, formatString("--gpus %u", count.number),
                    formatString("this machine has %zu", found.size()), "at most that",
                    "gsc-play --list-devices lists them");
    if (!count.all)
        found.resize(count.number);
    return found;
}

RemoteWorkers s_remote;
bool s_has_remote = false;

} // namespace

void setRemoteWorkers(RemoteWorkers workers)
{
    s_remote = std::move(workers);
    s_has_remote = true;
}

const RemoteWorkers* remoteWorkers()
{
    return s_has_remote ? &s_remote : nullptr;
}

bool drawsWithService(const DeviceChoice& choice)
{
    return choice.workers.several() || s_has_remote;
}

std::vector<DeviceId> workerDevices(const DeviceChoice& choice)
{
    const WorkerOptions& workers = choice.workers;
    std::vector<DeviceId> all = !workers.devices.empty() ? workers.devices
                                : workers.count.given    ? devicesOf(workers.count)
                                                         : std::vector<DeviceId>{{choice.backend, choice.device}};
    if (const RemoteWorkers* const remote = remoteWorkers())
        all.insert(all.end(), remote->devices.begin(), remote->devices.end());
    return all;
}

bool drawsOnGpu(const DeviceChoice& choice)
{
    const WorkerCount& count = choice.workers.count;
    return (count.given && !count.on_cpu) || std::ranges::any_of(workerDevices(choice), [](const DeviceId& device) {
               return bestDevice(device).backend == "cuda";
           });
}

DeviceId firstDevice(const DeviceChoice& choice, Reporter* log)
{
    return bestDevice(workerDevices(choice).front(), [log](const std::string& why) {
        if (log != nullptr)
            log->warning(why);
    });
}

ServiceOptions serviceOptions(const ModelChoice& model, const DeviceChoice& choice, Reporter& log)
{
    const WorkerOptions& workers = choice.workers;
    ServiceOptions service;
    service.devices = workerDevices(choice);
    service.devices.front() = firstDevice(choice, &log);
    if (const RemoteWorkers* const remote = remoteWorkers())
        service.make = [remote, model, backend = choice.backend](const DeviceId& device,
                                                                 const RendererOptions& limits) {
            return device.backend == "rank" ? remote->make(device, model, backend, limits)
                                            : makeRenderer(device, limits);
        };
    const auto on_cpu = size_t(std::ranges::count(service.devices, "cpu", &DeviceId::backend));
    service.renderer = {choice.threads, choice.vram_budget, choice.first_picture};
    if (service.renderer.first_picture) // a switch to tier exact waits until the file is loaded
        service.deadline = std::chrono::minutes(1);
    if (choice.threads == 0 && on_cpu > 1) // workers on CPUs share the cores
        service.renderer.threads = std::max(1, usableProcessors() / int(on_cpu));
    service.mode = service.devices.size() == 1 ? ServiceMode::Frame : workers.mode;
    service.pace.min_fps = workers.min_fps;
    service.pace.max_fps = workers.max_fps;
    // a CPU may take minutes for a frame of tier exact
    if (!std::ranges::all_of(service.devices, [](const DeviceId& device) { return device.backend == "cuda"; }))
        service.deadline = std::chrono::minutes(10);
    if (workers.faults && workers.faults->any()) {
        service.make = withFaults(*workers.faults, service.make);
        if (workers.faults->hangs > 0)
            service.deadline = std::min<ServiceTime>(service.deadline, workers.faults->hang / 2);
    }
    return service;
}

namespace {

std::vector<DeviceInfo> usableDevices()
{
    std::vector<DeviceInfo> all = devices();
    std::erase_if(all, [](const DeviceInfo& device) { return !device.usable; });
    return all;
}

template <typename Each>
void forEachLink(const std::vector<DeviceInfo>& all, const Each& each)
{
    for (const DeviceInfo& from : all)
        for (const DeviceInfo& to : all)
            if (from.id.backend == "cuda" && to.id.backend == "cuda" && from.id.ordinal < to.id.ordinal)
                each(deviceText(from.id), deviceText(to.id), deviceLink(from.id, to.id));
}

} // namespace

std::string deviceListText()
{
    const std::vector<DeviceInfo> all = usableDevices();
    std::string text;
    for (const DeviceInfo& device : all)
        text += formatString("%-14s %s\n", deviceText(device.id).c_str(), device.text.c_str());
    forEachLink(all, [&](const std::string& from, const std::string& to, const std::string& link) {
        text += formatString("%s - %s: %s\n", from.c_str(), to.c_str(), link.c_str());
    });
    return text;
}

std::string deviceListJson()
{
    using Json = OrderedJson;
    const std::vector<DeviceInfo> all = usableDevices();
    Json listed = Json::array(), links = Json::array();
    for (const DeviceInfo& device : all)
        listed.push_back({{"device", deviceText(device.id)},
                          {"name", device.name},
                          {"memory_bytes", device.memory_bytes > 0 ? Json(device.memory_bytes) : Json()},
                          {"text", device.text}});
    forEachLink(all, [&](const std::string& from, const std::string& to, const std::string& link) {
        links.push_back({{"from", from}, {"to", to}, {"link", link}});
    });
    return jsonText(Json{{"schema", "gsc.device-list/1"},
                         {"tool", {{"name", "gsc-play"}, {"version", toolVersion()}}},
                         {"devices", std::move(listed)},
                         {"links", std::move(links)}},
                    2) +
           "\n";
}

} // namespace gsc
