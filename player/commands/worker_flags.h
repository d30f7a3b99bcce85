// SPDX-License-Identifier: Apache-2.0
// The switches --gpus, --devices, --mode, --min-fps, --max-fps and --inject.
#pragma once

#include "player/options/play_options.h"

namespace CLI {
class App;
} // namespace CLI

namespace gsc {

void addWorkerOptions(CLI::App& app, PlayOptions& options);
// Refuses options that do not go together. Throws Error(Usage).
void checkWorkerOptions(const CLI::App& app, const PlayOptions& options);

} // namespace gsc
