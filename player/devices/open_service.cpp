// SPDX-License-Identifier: Apache-2.0
#include "player/devices/open_service.h"

#include <gsc/error.h>
#include "player/devices/worker_options.h"

#include <algorithm>

namespace gsc {

OpenedService openService(const std::shared_ptr<const Scene>& scene, const ModelChoice& model,
                          const DeviceChoice& choice, const std::function<void(ServiceOptions&)>& set, Reporter& log)
{
    std::vector<std::string> devices;
    const auto open = [&](const DeviceChoice& drawing) {
        ServiceOptions service = serviceOptions(model, drawing, log);
        service.keeps_all = false;
        set(service);
        devices.clear();
        for (const DeviceId& device : service.devices)
            devices.push_back(deviceText(device));
        return OpenedService{std::make_unique<RendererService>(scene, service), devices};
    };
    try {
        return open(choice);
    } catch (const Error& e) {
        const bool of_device =
            e.code() == ErrorCode::OutOfMemory || e.code() == ErrorCode::Unsupported || e.code() == ErrorCode::Device;
        const bool on_cpu = !devices.empty() && devices.front() == "cpu";
        if (choice.backend != "auto" || drawsWithService(choice) || on_cpu || !of_device)
            throw;
        log.warning(formatString("backend %s is passed over: %s", devices.empty() ? "auto" : devices.front().c_str(),
                                 e.what()));
    }
    return open(choice.of("cpu"));
}

bool allGone(const ServiceStats& stats)
{
    return std::ranges::all_of(stats.workers,
                               [](const WorkerStats& worker) { return worker.state == WorkerState::Gone; });
}

} // namespace gsc
