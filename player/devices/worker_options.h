// SPDX-License-Identifier: Apache-2.0
// Options for devices that draw together, and the way in which they divide the work.
#pragma once

#include "player/options/device_choice.h"
#include "runtime/cli/reporter.h"
#include "runtime/service/renderer_service.h"

#include <string>

namespace gsc {

// Returns the devices that the options ask for, one for each worker. Without --gpus and --devices this is the device
// of --backend and --device, which may be "auto", followed by the ranks of an MPI job. Throws Error (Usage, Device).
std::vector<DeviceId> workerDevices(const DeviceChoice& choice);

// Returns true if one of the workers' devices is a GPU; "auto" counts as the device that firstDevice() chooses. Throws
// as workerDevices() does, but not for GPUs that do not exist.
bool drawsOnGpu(const DeviceChoice& choice);

// Returns the first of the workers' devices; "auto" becomes the best that the machine can run. `log`, if not null,
// gets a warning for each better device that cannot be used. Throws as workerDevices() does.
DeviceId firstDevice(const DeviceChoice& choice, Reporter* log = nullptr);

// Makes the service options that the choice asks for. Warns of each device that "auto" passes over. Throws Error
// (Usage, Device).
ServiceOptions serviceOptions(const ModelChoice& model, const DeviceChoice& choice, Reporter& log);

// Bytes that this MPI rank received from other ranks, and how many of them were pixels and depths.
struct WireBytes {
    uint64_t all = 0, pictures = 0;
};

// Workers that run in other processes: the ranks of an MPI job (player/mpi).
struct RemoteWorkers {
    std::vector<DeviceId> devices;
    std::function<std::unique_ptr<Renderer>(const DeviceId&, const ModelChoice&, const std::string& backend,
                                            const RendererOptions&)>
        make;
    std::function<WireBytes()> wire;
};
void setRemoteWorkers(RemoteWorkers workers); // call before any other thread runs
const RemoteWorkers* remoteWorkers();         // null: this program has none

// Returns true if a renderer service draws, even one with a single worker.
bool drawsWithService(const DeviceChoice& choice);

// Text of gsc-play --list-devices: name, memory and links of each device; schemas/device-list.schema.json describes
// it.
std::string deviceListText();
std::string deviceListJson();

} // namespace gsc
