// SPDX-License-Identifier: Apache-2.0
// The options of `gsc-play FILE`, apart from the command so that tests can parse them.
#pragma once

#include "player/options/play_options.h"

namespace CLI {
class App;
} // namespace CLI

namespace gsc {

void addPlayOptions(CLI::App& app, PlayOptions& options);
// Call after parsing: --out of a folder becomes a pattern of pictures in it.
void settlePlayOptions(PlayOptions& options);
// Throws Error (Usage, Unsupported) if options contradict each other.
void checkPlayOptions(const CLI::App& app, const PlayOptions& options);

} // namespace gsc
