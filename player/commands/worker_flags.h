// SPDX-License-Identifier: Apache-2.0
// The options --gpus, --devices, --mode, --min-fps, --max-fps and --inject.
#pragma once

#include "player/options/play_options.h"

namespace CLI {
class App;
} // namespace CLI

namespace gsc {

void addWorkerOptions(CLI::App& app, PlayOptions& options);
// Throws Error (Usage, Unsupported, Device) if options contradict each other or the devices cannot do them. `sweeps`:
// a sweep file states the options of each run.
void checkWorkerOptions(const CLI::App& app, const PlayOptions& options, bool sweeps = false);

} // namespace gsc
