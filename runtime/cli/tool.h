// SPDX-License-Identifier: Apache-2.0
// Work of both programs around their commands: parsing, help, completion, manual pages, errors and exit codes.
#pragma once

#include <gsc/error.h>
#include "runtime/cli/reporter.h"

#include <functional>

namespace CLI {
class App;
} // namespace CLI

namespace gsc {

// Command that was asked for. Parsing only fills options; the command runs afterwards, from a plain struct.
struct Invocation {
    ReporterOptions reporter;
    std::function<ErrorCode(Reporter&)> run;
    const CLI::App* command = nullptr; // command whose options an error may name
};

// --format, -q, -v, --no-color, and --progress for commands that take long.
void addReporterOptions(CLI::App& command, ReporterOptions& options, bool takes_long);

// The commands help, completion and man, behind all others. Precondition: the root has a version flag.
void addToolCommands(CLI::App& root, Invocation& invocation);

// Runs it and turns whatever it throws into a message and a code.
ErrorCode runInvocation(const Invocation& invocation);

// A program: its name, its texts, and the function that declares its commands.
struct Program {
    std::string name, description, version, version_help, footer;
    void (*add_commands)(CLI::App& root, Invocation& invocation);
};

// Everything main() does. Returns the exit code; never throws.
int runProgram(const Program& program, int argc, const char* const* argv);
// runProgram() with the caller's own tree of commands.
int runTool(CLI::App& root, Invocation& invocation, int argc, const char* const* argv);

// gsc.error/1 (schemas/error.schema.json).
OrderedJson errorJson(const Error& error);

} // namespace gsc
