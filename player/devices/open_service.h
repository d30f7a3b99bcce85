// SPDX-License-Identifier: Apache-2.0
// Opens the renderer service that the command line asks for. It draws in real time: the newest pose is drawn next.
#pragma once

#include "player/options/device_choice.h"
#include "runtime/cli/reporter.h"
#include "runtime/service/renderer_service.h"

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace gsc {

struct OpenedService {
    std::unique_ptr<RendererService> service;
    std::vector<std::string> devices; // names of the devices that draw, a name for each worker
};

// Opens the service. With --backend auto, the CPU loads a model that a better device cannot load. `set` changes
// service options that no option of the command line sets. Throws Error.
OpenedService openService(const std::shared_ptr<const Scene>& scene, const ModelChoice& model,
                          const DeviceChoice& choice, const std::function<void(ServiceOptions&)>& set, Reporter& log);

bool allGone(const ServiceStats& stats); // true if no worker is left

} // namespace gsc
