// SPDX-License-Identifier: Apache-2.0
#include "convert/commands/command.h"
#include "runtime/cli/version.h"

namespace gsc {

namespace {

const char* const kFooter = R"(exit codes:
  0 ok (warnings allowed)   1 usage   2 input/output, disk full   3 invalid file
  4 internal   5 unsupported   6 out of memory   7 device
  8 difference or threshold exceeded   130 interrupted (nothing half-written)

Results go to stdout, everything else to stderr. `gsc help COMMAND` tells more
about one command.)";

} // namespace

std::vector<std::string> partsOf(const std::string& list)
{
    std::vector<std::string> parts;
    for (size_t at = 0; at <= list.size(); at += parts.back().size() + 1)
        parts.push_back(list.substr(at, list.find(',', at) - at));
    return parts;
}

int runGsc(int argc, const char* const* argv)
{
    return runProgram({"gsc", "Turns trained Scaffold-GS and Octree-GS models into .gsc files, and checks them.",
                       versionText("gsc"),
                       "print the version, the commit, and the versions of the file format and of CUDA", kFooter,
                       [](CLI::App& root, Invocation& invocation) {
                           addConvertCommand(root, invocation);
                           addValidateCommand(root, invocation);
                           addInfoCommand(root, invocation);
                           addCompareCommand(root, invocation);
                           addComparePicturesCommand(root, invocation);
                           addBakeCommand(root, invocation);
                           addArchiveCommand(root, invocation);
                           addExportCommand(root, invocation);
                           addChartCommand(root, invocation);
                           addMergeRunsCommand(root, invocation);
                           addSampleCommand(root, invocation);
                       }},
                      argc, argv);
}

} // namespace gsc
