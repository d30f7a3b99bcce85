// SPDX-License-Identifier: Apache-2.0
#include "player/devices/open_service.h"

#include "player/devices/worker_options.h"
#include "runtime/devices/device_fallback.h"

#include <algorithm>

namespace gsc {

OpenedService openService(const std::shared_ptr<const Scene>& scene, const ModelChoice& model,
                          const DeviceChoice& choice, const std::function<void(ServiceOptions&)>& set, Reporter& log)
{
    const DeviceId asked{choice.backend, choice.device};
    DeviceId taken = asked;
    const auto open = [&](const DeviceId& on) {
        ServiceOptions service = serviceOptions(model, choice.of(on), log);
        service.keeps_all = false;
        set(service);
        taken = service.devices.front();
        std::vector<std::string> devices;
        for (const DeviceId& device : service.devices)
            devices.push_back(deviceText(device));
        return OpenedService{std::make_unique<RendererService>(scene, service), devices};
    };
    if (drawsWithService(choice))
        return open(asked);
    return orOnCpu(asked, taken, open, [&log](const std::string& why) { log.warning(why); });
}

bool allGone(const ServiceStats& stats)
{
    return std::ranges::all_of(stats.workers,
                               [](const WorkerStats& worker) { return worker.state == WorkerState::Gone; });
}

} // namespace gsc
