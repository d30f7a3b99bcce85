// SPDX-License-Identifier: Apache-2.0
// The switches --gpus, --devices, --mode, --min-fps, --max-fps and --inject.
#pragma once

#include "player/options/play_options.h"

namespace CLI {
class App;
} // namespace CLI

namespace gsc {

void addWorkerOptions(CLI::App& app, PlayOptions& options);
// Refuses options that do not go together, and what the devices do not do unless runs of a sweep say what that is. Throws
// Error (Usage, Unsupported, Device).
void checkWorkerOptions(const CLI::App& app, const PlayOptions& options, bool sweeps = false);

} // namespace gsc
