// SPDX-License-Identifier: Apache-2.0
// The service that the command line asks for, fed in real time: the newest pose is drawn next.
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
    std::vector<std::string> devices; // names of the devices that draw
};

// Opens the service. The CPU loads a model that the better device cannot load, where the options leave the choice.
// `set` changes service options that the command line has no word for. Throws Error.
OpenedService openService(const std::shared_ptr<const Scene>& scene, const ModelChoice& model,
                          const DeviceChoice& choice, const std::function<void(ServiceOptions&)>& set, Reporter& log);

bool allGone(const ServiceStats& stats); // every worker

} // namespace gsc
