// SPDX-License-Identifier: Apache-2.0
// The commands of gsc.
#pragma once

#include "player/tool/tool.h"

namespace gsc {

using Json = OrderedJson;

void addConvertCommand(CLI::App& app, Invocation& invocation);
void addValidateCommand(CLI::App& app, Invocation& invocation);
void addInfoCommand(CLI::App& app, Invocation& invocation);
void addCompareCommand(CLI::App& app, Invocation& invocation);
void addExportCommand(CLI::App& app, Invocation& invocation);
void addChartCommand(CLI::App& app, Invocation& invocation);
void addSampleCommand(CLI::App& app, Invocation& invocation);
void addSamplePathsCommand(CLI::App& sample, Invocation& invocation); // below `gsc sample`

// Everything main() does. Returns the exit code; never throws.
int runGsc(int argc, const char* const* argv);

} // namespace gsc
