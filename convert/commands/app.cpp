// SPDX-License-Identifier: Apache-2.0
#include "convert/commands/command.h"
#include "player/tool/help_format.h"
#include "player/tool/version.h"

#include <CLI/CLI.hpp>

namespace gsc {

namespace {

const char* const kFooter = R"(exit codes:
  0 ok (warnings allowed)   1 usage              2 input/output, disk full   3 invalid file
  4 internal                5 unsupported        6 out of memory             7 device
  8 difference or threshold exceeded           130 interrupted (nothing half-written is left)

Results go to stdout, everything else to stderr. `gsc help COMMAND` tells more about one command.)";

} // namespace

int runGsc(int argc, const char* const* argv)
{
    CLI::App app("Turns trained Scaffold-GS and Octree-GS models into .gsc files, and checks them.", "gsc");
    app.formatter(helpFormatter());
    app.set_version_flag("--version", versionText("gsc"), "version, commit, file format and CUDA");
    app.require_subcommand(0, 1);
    app.footer(kFooter);
    Invocation invocation;
    addConvertCommand(app, invocation);
    addValidateCommand(app, invocation);
    addInfoCommand(app, invocation);
    addCompareCommand(app, invocation);
    addChartCommand(app, invocation);
    addSampleCommand(app, invocation);
    addToolCommands(app, invocation);
    return runTool(app, invocation, argc, argv);
}

} // namespace gsc
