// SPDX-License-Identifier: Apache-2.0
// The switches --gpus, --devices, --mode, --min-fps, --max-fps and --inject.
#pragma once

#include "player/options/play_options.h"

namespace CLI {
class App;
} // namespace CLI

namespace gsc {

void addWorkerOptions(CLI::App& app, PlayOptions& options);
// Refuses options that contradict each other, and such that the devices cannot do; sweeps: their runs choose the
// options. Throws Error (Usage, Unsupported, Device).
void checkWorkerOptions(const CLI::App& app, const PlayOptions& options, bool sweeps = false);

} // namespace gsc
