// SPDX-License-Identifier: Apache-2.0
// Declares the commands of gsc.
#pragma once

#include "runtime/cli/options.h"
#include "runtime/cli/tool.h"

#include <array>
#include <memory>
#include <string>
#include <vector>

namespace gsc {

using Json = OrderedJson;

void addConvertCommand(CLI::App& app, Invocation& invocation);
void addValidateCommand(CLI::App& app, Invocation& invocation);
void addInfoCommand(CLI::App& app, Invocation& invocation);
void addCompareCommand(CLI::App& app, Invocation& invocation);
void addComparePicturesCommand(CLI::App& app, Invocation& invocation);
void addBakeCommand(CLI::App& app, Invocation& invocation);
void addArchiveCommand(CLI::App& app, Invocation& invocation);
void addExportCommand(CLI::App& app, Invocation& invocation);
void addChartCommand(CLI::App& app, Invocation& invocation);
void addMergeRunsCommand(CLI::App& app, Invocation& invocation);
void addSampleCommand(CLI::App& app, Invocation& invocation);
void addSamplePathsCommand(CLI::App& sample, Invocation& invocation); // makes a subcommand of `gsc sample`

struct LpipsFiles; // defined in convert/compare/picture_set.h
// Adds --lpips-backbone and --lpips-heads, of which both or none must be given.
std::array<OptionHandle, 2> addLpipsOptions(CLI::App& command, LpipsFiles& files);

// Makes `run`, with the options of the command, the function that is called after the command line was parsed.
template <typename Options>
void onParsed(CLI::App& command, Invocation& invocation, const std::shared_ptr<Options>& options,
              ErrorCode (*run)(const Options&, Reporter&))
{
    onParsed(command, [=, &invocation] { invocation.run = [=](Reporter& report) { return run(*options, report); }; });
}

// Splits a list at its commas; at least one part is returned.
std::vector<std::string> partsOf(const std::string& list);

// Runs the program: all that main() does. Returns the exit code; never throws.
int runGsc(int argc, const char* const* argv);

} // namespace gsc
