// SPDX-License-Identifier: Apache-2.0
// The options of `gsc-play FILE`, apart from the command so that tests parse them.
#pragma once

#include "player/options/play_options.h"

namespace CLI {
class App;
} // namespace CLI

namespace gsc {

void addPlayOptions(CLI::App& app, PlayOptions& options);
// Checks options against each other. Throws Error (Usage, Unsupported).
void checkPlayOptions(const CLI::App& app, const PlayOptions& options);

} // namespace gsc
