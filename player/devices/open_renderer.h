// SPDX-License-Identifier: Apache-2.0
// The renderer that the command line asks for, with the model loaded.
#pragma once

#include "player/options/device_choice.h"
#include "runtime/cli/reporter.h"
#include <gsc/renderer.h>

#include <memory>

namespace gsc {

// Opens the file and checks it as Scene::open() does. The device starts meanwhile.
std::shared_ptr<const Scene> openScene(const ModelChoice& model, const DeviceChoice& choice);

// Several devices as one renderer (runtime/service/service_renderer.h) where the options ask for that. Otherwise, with
// --backend auto, what a better backend cannot load, for want of memory or of support, the CPU loads instead, after a
// warning. `load_ms`: how long the loading took. Throws Error.
std::unique_ptr<Renderer> openRenderer(const ModelChoice& model, const DeviceChoice& choice,
                                       std::shared_ptr<const Scene> scene, Reporter& log, double& load_ms);

} // namespace gsc
