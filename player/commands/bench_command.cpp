// SPDX-License-Identifier: Apache-2.0
#include <gsc/error.h>
#include <gsc/file/output_paths.h>
#include "player/measure/bench.h"
#include "player/commands/commands.h"
#include "player/commands/render_options.h"
#include "runtime/records/row_file.h"
#include "player/measure/run_text.h"
#include "player/sweep/sweep.h"
#include "runtime/cli/options.h"
#include "player/commands/worker_flags.h"

#include <memory>

namespace gsc {

namespace {

constexpr const char* kBenchExamples = R"(examples:
  gsc-play bench room.gsc --size 1920x1080
      300 frames round the stored cameras after 50 of warm-up, as a table
  gsc-play bench city.gsc --cameras flight.json --eyes 2 --ipd 0.065 \
      --size 2048x2048 --fov 90 --quality 16 --out b.jsonl
      two eyes on a path, 16 frames scored against the tier exact, a line added
      to b.jsonl
  gsc-play bench room.gsc --sweep sweep.json --out runs.jsonl
      every combination of reuse, bounds and budgets that sweep.json asks for;
      gsc chart draws runs.jsonl

Images stay on the device. Times of stages are the device's own, `wall` is what
the caller waits for a frame, or with two in flight from frame to frame. A sweep
scores every frame: a backend on the host is timed and scored in one pass,
scoring outside the times; any other is timed first and renders again for the
scores.)";

void addBenchOptions(CLI::App& app, BenchOptions& options)
{
    const Heading heading(app, "Measuring");
    constexpr int64_t kMany = 1000000;
    addInteger(app, "--warmup", options.warmup, 0, kMany, "N (default: 50)", "frames before the measured ones");
    addInteger(app, "--measure", options.measured, 1, kMany, "N (default: 300)",
               "frames to measure, going round the cameras");
    addInteger(app, "--frames-in-flight", options.in_flight, 1, 256, "N (default: 1)",
               "frames submitted before the first is waited for, at most 2 or 3 for each device: 2 leave one device no "
               "pause between frames, 3 for each device where several take turns")
        .rare();
    addInteger(app, "--quality", options.quality, 0, kMany, "N (default: 0)",
               "cameras to score against the tier exact, spread over all; with reuse, --detail, --lod-hysteresis or "
               "--target-ms the path is played up to the last scored one");
    addScoreFrames(app, options.score);
    for (const char* option : {"--score-every", "--score-first"})
        optionOf(app, option).excludes(optionOf(app, "--quality"));
    addBackend(app, "--reference", options.reference, false, "backend that renders exact for scores").rare();
    addText(app, "--label", options.label, "TEXT", "text for the report, such as what changed").rare();
    addText(app, "--out", options.out, "FILE.jsonl",
            "file to add one row to (schemas/run.schema.json), which gsc chart draws; - is standard output");
    OptionHandle sweep = addText(app, "--sweep", options.sweep, "FILE.json",
                                 "run every combination that the file asks for (schemas/sweep.schema.json), each from "
                                 "a cold start, scored against exact; a row for each is added to --out, "
                                 "from which a sweep that was stopped goes on");
    for (const char* fixed : {"--cameras", "--frames", "--warmup", "--measure", "--quality", "--score-every",
                              "--score-first", "--target-ms", "--frames-in-flight", "--gpus", "--devices"})
        sweep.excludes(optionOf(app, fixed)); // set in the file of the sweep
    addShard(app, options.play, "the runs of --sweep", "--out");
}

void checkBenchOptions(const CLI::App& app, const BenchOptions& options)
{
    checkRenderOptions(app, options.play, !options.sweep.empty());
    checkWorkerOptions(app, options.play, !options.sweep.empty());
    checkEffect(app, "--shard", !options.sweep.empty(), "--sweep");
    checkShardFile(options.play, "--out", options.out);
    checkEffect(app, "--reference", scores(options) || !options.sweep.empty(), "--quality, --score-every or --sweep");
}

ErrorCode runSweep(const BenchOptions& options, Reporter& report)
{
    bool first = true;
    sweep(options, report, [&](const RunRow& row) {
        report.endProgress(false);
        const std::string text =
            report.json() ? jsonText(toJson(row), -1) : (first ? runTableHeader() : "") + runTableLine(row);
        isStandardOutput(options.out) ? report.tell(text) : report.text(text);
        report.flush();
        first = false;
    });
    return ErrorCode::Ok;
}

ErrorCode runBench(const BenchOptions& options, Reporter& report)
{
    const RunRow row = bench(options, report);
    report.endProgress(false);
    const std::string json = jsonText(toJson(row), -1);
    if (!options.out.empty())
        addRow(options.out, kRunRow, json);
    const std::string text = report.json() ? json : benchText(row);
    isStandardOutput(options.out) ? report.tell(text) : report.text(text);
    return ErrorCode::Ok;
}

} // namespace

void addBenchCommand(CLI::App& root, Invocation& invocation)
{
    auto options = std::make_shared<BenchOptions>();
    CLI::App& command = addCommand(root, "bench", "Measure the cost of frames, or sweep speed and accuracy");
    addFile(command, options->play);
    optionOf(command, "FILE").required();
    addCameras(command, options->play);
    addFrames(command, options->play);
    addViewOptions(command, options->play);
    addRunOptions(command, options->play);
    addWorkerOptions(command, options->play);
    addTargetOption(command, options->play);
    addBenchOptions(command, *options);
    addReporterOptions(command, invocation.reporter, true);
    setFooter(command, kBenchExamples);
    onParsed(command, [&command, &invocation, options] {
        options->scores_path = isGiven(command, "--score-every") || isGiven(command, "--score-first");
        checkBenchOptions(command, *options);
        invocation.run = [options](Reporter& report) {
            return options->sweep.empty() ? runBench(*options, report) : runSweep(*options, report);
        };
    });
}

} // namespace gsc
