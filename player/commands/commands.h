// SPDX-License-Identifier: Apache-2.0
// The commands of gsc-play. Playing has no command: gsc-play FILE plays.
#pragma once

#include "runtime/cli/tool.h"

namespace gsc {

void addPlayCommand(CLI::App& root, Invocation& invocation);
void addBenchCommand(CLI::App& root, Invocation& invocation);
void addStabilityCommand(CLI::App& root, Invocation& invocation);
void addLiveCommand(CLI::App& root, Invocation& invocation);
void addWindowCommand(CLI::App& root, Invocation& invocation);
void addXrCommand(CLI::App& root, Invocation& invocation);
void addBackendsCommand(CLI::App& root, Invocation& invocation);

// Everything main() does. Returns the exit code; never throws.
int runGscPlay(int argc, const char* const* argv);

} // namespace gsc
