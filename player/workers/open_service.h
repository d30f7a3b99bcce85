// SPDX-License-Identifier: Apache-2.0
// The service that the command line asks for, fed in real time: the newest pose is drawn next.
#pragma once

#include "player/play_options.h"
#include "player/tool/reporter.h"
#include "runtime/service/renderer_service.h"

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace gsc {

// What the better device cannot load, the CPU loads, where the options leave the choice. `set` changes what the options say
// nothing of; `devices` takes what draws, as it is named. Throws Error.
std::unique_ptr<RendererService> openService(const std::shared_ptr<const Scene>& scene, const PlayOptions& options,
                                             const std::function<void(ServiceOptions&)>& set,
                                             std::vector<std::string>& devices, Reporter& log);

bool allGone(const ServiceStats& stats); // every worker

} // namespace gsc
