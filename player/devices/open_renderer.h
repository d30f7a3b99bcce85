// SPDX-License-Identifier: Apache-2.0
// Opens the model and makes the renderer that the command line asks for.
#pragma once

#include "player/options/device_choice.h"
#include "runtime/cli/reporter.h"
#include <gsc/renderer.h>

#include <memory>

namespace gsc {

// Opens the model's file, or what convertModel() makes of a trained model, and checks it as Scene::open() does. Another
// thread starts the device in the meantime.
std::shared_ptr<const Scene> openScene(const ModelChoice& model, const DeviceChoice& choice, Reporter& log);

// Makes a renderer with the model loaded. If the options ask for several devices, they act as one renderer
// (runtime/service/service_renderer.h). Otherwise, with --backend auto, the CPU loads a model for which a better
// device lacks memory or support, after a warning. `load_ms` receives the time of loading. Throws Error.
std::unique_ptr<Renderer> openRenderer(const ModelChoice& model, const DeviceChoice& choice,
                                       std::shared_ptr<const Scene> scene, Reporter& log, double& load_ms);

} // namespace gsc
