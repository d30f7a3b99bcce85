// SPDX-License-Identifier: Apache-2.0
// Devices that draw together, and the way they share the work.
#pragma once

#include "player/options/device_choice.h"
#include "runtime/cli/reporter.h"
#include "runtime/service/renderer_service.h"

#include <string>

namespace gsc {

// The devices that the options ask for, a worker each. Without --gpus and --devices the device of --backend and
// --device, which may be "auto"; then the ranks of an MPI job. Throws Error (Usage, Device).
std::vector<DeviceId> workerDevices(const DeviceChoice& choice);

// True if one of them is a GPU; "auto" as firstDevice() resolves it. Throws as workerDevices(), but not for GPUs that
// do not exist.
bool drawsOnGpu(const DeviceChoice& choice);

// First of the workers' devices; "auto" becomes the best that the machine can run. `log`, if not null, gets a warning
// of each better one that cannot be used. Throws as workerDevices().
DeviceId firstDevice(const DeviceChoice& choice, Reporter* log = nullptr);

// All that the choice asks of a service. A device that "auto" passes over is a warning. Throws Error (Usage, Device).
ServiceOptions serviceOptions(const ModelChoice& model, const DeviceChoice& choice, Reporter& log);

// Bytes that came from other ranks to this one, and how many of them were pixels and depths.
struct WireBytes {
    uint64_t all = 0, pictures = 0;
};

// Workers beside this process's own, of a program that has some (player/mpi).
struct RemoteWorkers {
    std::vector<DeviceId> devices;
    std::function<std::unique_ptr<Renderer>(const DeviceId&, const ModelChoice&, const std::string& backend,
                                            const RendererOptions&)>
        make;
    std::function<WireBytes()> wire;
};
void setRemoteWorkers(RemoteWorkers workers); // before any other thread runs
const RemoteWorkers* remoteWorkers();         // null = none

// True if a service draws, even with a single worker.
bool drawsWithService(const DeviceChoice& choice);

// gsc-play --list-devices: name, memory and links. schemas/device-list.schema.json
std::string deviceListText();
std::string deviceListJson();

} // namespace gsc
