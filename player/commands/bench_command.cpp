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
      measures 300 frames over the stored cameras, after 50 frames of warm-up
  gsc-play bench room.gsc --size 1920x1080 --until-steady 1
      as many frames as make the median sure to 1 %
  gsc-play bench city.gsc --cameras flight.json --eyes 2 --ipd 0.065 \
      --size 2048x2048 --fov 90 --quality 16 --out b.jsonl
      two eyes on a path, 16 frames compared with exact pictures; adds a line to
      b.jsonl
  gsc-play bench room.gsc --sweep sweep.json --out runs.jsonl
      one run for every combination of settings in sweep.json; `gsc chart` draws
      runs.jsonl

Images stay on the device. Times of stages are measured by the device; `wall` is
the time from submitting a frame to its end, or with more frames in flight the
time from frame to frame. A sweep compares every frame with an exact one and
leaves that out of the times; a GPU draws the path again for it.)";

void addBenchOptions(CLI::App& app, BenchOptions& options)
{
    const Heading heading(app, "Measuring");
    constexpr int64_t kMany = 1000000;
    addInteger(app, "--warmup", options.warmup, 0, kMany, "N (default: 50)",
               "frames to draw before the measured ones, which fill caches and raise the clocks");
    addInteger(app, "--measure", options.measured, 1, kMany, "N (default: 300)",
               "frames to measure; they take the cameras in turn, again and again");
    addNumber(
        app, "--until-steady", options.until_steady, {0.01, 100}, " per cent", "PERCENT",
        "end as soon as the median frame time is known to this many per cent, with a probability of 95 %, after whole "
        "rounds of the cameras; --measure is then the most frames, by default 10000");
    addInteger(
        app, "--frames-in-flight", options.in_flight, 1, 256, "N (default: 1)",
        "frames submitted before the first is waited for, at most 2 or 3 for each device; with 2 a device has no "
        "pause between frames, with 3 for each none of several devices has")
        .rare();
    addInteger(app, "--quality", options.quality, 0, kMany, "N (default: 0)",
               "cameras whose pictures are compared with exact ones, evenly spread over all; 0 = none. With reuse, "
               "--detail, --lod-hysteresis or --target-ms the path is drawn up to the last of them");
    addScoreFrames(app, options.score);
    for (const char* option : {"--score-every", "--score-first"})
        optionOf(app, option).excludes(optionOf(app, "--quality"));
    addBackend(app, "--reference", options.reference, false,
               "backend that draws the exact pictures (default: the measured one)")
        .rare();
    addText(app, "--label", options.label, "TEXT", "free text for the report, such as the change that is measured")
        .rare();
    addText(
        app, "--out", options.out, "FILE.jsonl",
        "file to add the result to, as a line of JSON (schemas/run.schema.json), which gsc chart draws; - is standard "
        "output");
    OptionHandle sweep =
        addText(app, "--sweep", options.sweep, "FILE.json",
                "measure every combination of the settings in a file (schemas/sweep.schema.json), each with "
                "empty caches at its start and compared with exact pictures; each adds a line to --out. A "
                "sweep that was stopped continues there: it skips the runs in --out");
    for (const char* fixed :
         {"--cameras", "--position", "--look-at", "--frames", "--warmup", "--measure", "--until-steady", "--quality",
          "--score-every", "--score-first", "--target-ms", "--frames-in-flight", "--gpus", "--devices"})
        sweep.excludes(optionOf(app, fixed)); // set in the file of the sweep
    addShard(app, options.play, "the runs of --sweep", "--out");
}

void checkBenchOptions(const CLI::App& app, const BenchOptions& options)
{
    checkRenderOptions(app, options.play, !options.sweep.empty());
    checkOwnCamera(app, options.play.cameras);
    checkWorkerOptions(app, options.play, !options.sweep.empty());
    checkEffect(app, "--shard", !options.sweep.empty(), "--sweep");
    checkShardFile(options.play, "--out", options.out);
    checkEffect(app, "--reference", scores(options) || !options.sweep.empty(), "--quality, --score-every or --sweep");
}

ErrorCode runSweep(const BenchOptions& options, Reporter& report)
{
    bool first = true;
    sweep(options, report, [&](const RunRow& row) {
        const std::string text =
            report.json() ? jsonText(toJson(row), -1) : (first ? runTableHeader() : "") + runTableLine(row);
        isStandardOutput(options.out) ? report.tell(text) : report.text(text);
        report.flush();
        first = false;
    });
    report.endProgress(false);
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
    addOwnCamera(command, options->play);
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
        if (isGiven(command, "--until-steady") && !isGiven(command, "--measure"))
            options->measured = 10000;
        checkBenchOptions(command, *options);
        invocation.run = [options](Reporter& report) {
            return options->sweep.empty() ? runBench(*options, report) : runSweep(*options, report);
        };
    });
}

} // namespace gsc
