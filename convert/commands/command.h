// SPDX-License-Identifier: Apache-2.0
// One gsc, several subcommands. Parsing only fills options; the command runs afterwards, from a plain struct.
#pragma once

#include "convert/commands/reporter.h"
#include "format/error.h"

#include <functional>

namespace CLI {
class App;
class Option;
} // namespace CLI

namespace gsc {

// What the command line asked for.
struct Invocation {
    ReporterOptions reporter;
    std::function<ErrorCode(Reporter&)> run;
};

void addConvertCommand(CLI::App& app, Invocation& invocation);
void addValidateCommand(CLI::App& app, Invocation& invocation);
void addInfoCommand(CLI::App& app, Invocation& invocation);
void addCompareCommand(CLI::App& app, Invocation& invocation);
void addChartCommand(CLI::App& app, Invocation& invocation);
void addSampleCommand(CLI::App& app, Invocation& invocation);
void addSamplePathsCommand(CLI::App& sample, Invocation& invocation); // below `gsc sample`

// --format, -q, -v, --no-color, and --progress for commands that take long.
void addReporterOptions(CLI::App& command, ReporterOptions& options, bool takes_long);
// An option that takes "8G" (bytes) or "20M" (a count).
CLI::Option* addByteSizeOption(CLI::App& command, const char* names, uint64_t& value, const char* help);
CLI::Option* addCountOption(CLI::App& command, const char* names, uint64_t& value, const char* help);

// Runs it and turns whatever it throws into a message and a code.
ErrorCode runInvocation(const Invocation& invocation);

// Everything main() does. Returns the exit code; never throws.
int runGsc(int argc, const char* const* argv);

} // namespace gsc
