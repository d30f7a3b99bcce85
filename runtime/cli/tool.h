// SPDX-License-Identifier: Apache-2.0
// Main program of both tools around their commands: parsing, help, completion, manual pages, errors and exit codes.
#pragma once

#include <gsc/error.h>
#include "runtime/cli/reporter.h"

#include <functional>

namespace CLI {
class App;
} // namespace CLI

namespace gsc {

// The command to run. Parsing only fills options into a plain struct; the command runs afterwards.
struct Invocation {
    ReporterOptions reporter;
    std::function<ErrorCode(Reporter&)> run;
    const CLI::App* command = nullptr; // command whose options an error may name; null = all commands
};

// Adds --format, -q, -v, --no-color, and --progress for commands that `takes_long`.
void addReporterOptions(CLI::App& command, ReporterOptions& options, bool takes_long);

// Adds the commands help, completion and man behind all others. Precondition: the root has a version flag.
void addToolCommands(CLI::App& root, Invocation& invocation);

// Runs the command, and turns anything it throws into a message and an exit code.
ErrorCode runInvocation(const Invocation& invocation);

// A program: name, texts, and the function that declares its commands.
struct Program {
    std::string name, description, version, version_help, footer;
    void (*add_commands)(CLI::App& root, Invocation& invocation);
};

// Runs the whole program. Returns the exit code; never throws.
int runProgram(const Program& program, int argc, const char* const* argv);
// Does as runProgram(), with commands that the caller declared.
int runTool(CLI::App& root, Invocation& invocation, int argc, const char* const* argv);

// Returns the error as an object of gsc.error/1 (schemas/error.schema.json).
OrderedJson errorJson(const Error& error);

} // namespace gsc
