// SPDX-License-Identifier: Apache-2.0
#include "format/numbers/count_text.h"
#include "convert/commands/command.h"

#include "convert/merge/merge_runs.h"
#include <gsc/file/output_file.h>
#include <gsc/file/read_file.h>
#include "runtime/cli/version.h"

namespace gsc {

namespace {

constexpr uint64_t kMaxRows = uint64_t(1) << 32; // most bytes of a file

struct MergeOptions {
    std::vector<std::string> inputs;
    std::string output;
    bool overwrite = false, allow_missing = false;
};

// Checks the output, before any input is read. Throws Error.
void checkMergeOutput(const MergeOptions& options, const Reporter& report)
{
    checkStandardOutput(options.output, "--output", report.json());
    std::vector<NamedPath> inputs;
    for (const std::string& input : options.inputs) // standard input may be redirected from a file
        inputs.push_back({isStandardOutput(input) ? "/dev/stdin" : input, "an input"});
    const NamedPath output{options.output, "--output"};
    checkOutputsDiffer(std::span(&output, 1), inputs);
    checkOutput(options.output, OutputKind::Text, options.overwrite);
}

Json mergeReport(const MergeOptions& options, const MergedRuns& merged, const Reporter& report)
{
    return {{"schema", "gsc.merge/1"},   {"tool", {{"name", "gsc"}, {"version", toolVersion()}}},
            {"output", options.output},  {"rows_schema", merged.schema},
            {"shards", merged.shards},   {"tasks", merged.tasks},
            {"rows", merged.rows},       {"missing", merged.missing},
            {"devices", merged.devices}, {"warnings", report.warnings()}};
}

ErrorCode runMerge(const MergeOptions& options, Reporter& report)
{
    checkMergeOutput(options, report);
    RunMerger merger;
    for (const std::string& input : options.inputs)
        merger.add(readInputText(input, kMaxRows, "rows of gsc-play --shard"), input);
    const MergedRuns merged = merger.finish(options.allow_missing);
    if (!merged.missing.empty())
        report.warning(formatString("%s of %s have no row", formatCount(merged.missing.size()).c_str(),
                                    formatCount(merged.tasks, "task").c_str()));
    if (merged.devices.size() > 1)
        report.warning(formatString("the shards ran on %zu kinds of devices (%s, %s%s): their times are not to be "
                                    "compared",
                                    merged.devices.size(), merged.devices[0].c_str(), merged.devices[1].c_str(),
                                    merged.devices.size() > 2 ? ", ..." : ""));
    if (merged.exceeded > 0)
        report.warning(formatString("%s of %s exceed a bound", formatCount(merged.exceeded).c_str(),
                                    formatCount(merged.rows, "trajectory", "trajectories").c_str()));
    writeTextFile(options.output, merged.text, options.overwrite);
    if (report.json())
        report.object(mergeReport(options, merged, report));
    report.done(formatString("merged %s of %s into %s", formatCount(merged.rows, "row").c_str(),
                             formatCount(merged.shards, "shard").c_str(), options.output.c_str()));
    return merged.exceeded == 0 ? ErrorCode::Ok : ErrorCode::Difference;
}

} // namespace

void addMergeRunsCommand(CLI::App& app, Invocation& invocation)
{
    auto options = std::make_shared<MergeOptions>();
    CLI::App& command = addCommand(app, "merge-runs", "Join the results of all shards of gsc-play --shard in one file");
    addTexts(command, "ROWS", options->inputs, "FILE.jsonl...",
             "files of the shards: --stats of pictures, or --out of a sweep or of gsc-play stability; - is standard "
             "input")
        .required();
    addText(command, "-o,--output", options->output, "FILE",
            "file to write, equal to that of a run without shards; - is standard output")
        .required();
    addFlag(command, "-w,--overwrite", options->overwrite, "replace a file that exists");
    addFlag(command, "--allow-missing", options->allow_missing,
            "also join if results are missing, such as runs of a sweep that a backend cannot draw")
        .rare();
    addReporterOptions(command, invocation.reporter, false);
    setFooter(command, "Results are written in the order of the run; the order of the files is free. A\n"
                       "result that is missing or there twice is an error, and so are files that differ\n"
                       "in model, settings, number of shards or version of gsc-play. Exits with 8, after\n"
                       "writing, if a trajectory of gsc-play stability exceeds a bound.\n"
                       "\n"
                       "example:\n"
                       "  gsc merge-runs shard_*.jsonl -o runs.jsonl && \\\n"
                       "      gsc chart runs.jsonl -o report.html");
    onParsed(command, invocation, options, runMerge);
}

} // namespace gsc
