// SPDX-License-Identifier: Apache-2.0
// The backend that the command line asks for, with the model loaded.
#pragma once

#include "player/play_options.h"
#include "player/tool/reporter.h"
#include "runtime/backend.h"
#include "runtime/scene.h"

#include <memory>

namespace gsc {

// With --backend auto what a better backend cannot load, for want of memory or of support, the CPU loads instead, after a
// warning. `load_ms`: how long the loading took. Throws Error.
std::unique_ptr<Backend> openBackend(const PlayOptions& options, const Scene& scene, Reporter& log, double& load_ms);

} // namespace gsc
