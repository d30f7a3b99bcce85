// SPDX-License-Identifier: Apache-2.0
// Entry points of the commands of gsc-play. Playing has no command word: `gsc-play FILE` plays.
#pragma once

#include "runtime/cli/tool.h"

namespace gsc {

struct WindowOptions;

void addPlayCommand(CLI::App& root, Invocation& invocation);
void addBenchCommand(CLI::App& root, Invocation& invocation);
void addStabilityCommand(CLI::App& root, Invocation& invocation);
void addLiveCommand(CLI::App& root, Invocation& invocation);
void addWindowCommand(CLI::App& root, Invocation& invocation);
void addXrCommand(CLI::App& root, Invocation& invocation);
void addBackendsCommand(CLI::App& root, Invocation& invocation);

// Runs the command `window`.
ErrorCode runWindowCommand(const WindowOptions& options, Reporter& report);

// Runs the whole program: parses the command line and runs the command. Returns the exit code; never throws.
int runGscPlay(int argc, const char* const* argv);

} // namespace gsc
