// SPDX-License-Identifier: Apache-2.0
// The options about what is kept between frames.
#pragma once

#include "player/play_options.h"

#include <CLI/CLI.hpp>

namespace gsc {

// --reuse and what belongs to it, --lod-bias, --lod-fade, --lod-hysteresis.
void addReuseOptions(CLI::App& app, PlayOptions& options);

// --target-ms.
void addTargetOption(CLI::App& app, PlayOptions& options);

// After parsing: numbers in range, and no option whose policy was not asked for. Throws Error(Usage).
void checkReuseOptions(const CLI::App& app, const PlayOptions& options);

} // namespace gsc
