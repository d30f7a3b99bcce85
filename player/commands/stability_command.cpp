// SPDX-License-Identifier: Apache-2.0
#include <gsc/error.h>
#include "player/commands/commands.h"
#include "player/commands/render_options.h"
#include "player/measure/stability.h"
#include "runtime/cli/options.h"
#include "player/commands/worker_flags.h"

#include <memory>

namespace gsc {

namespace {

constexpr const char* kStabilityExamples = R"(example:
  gsc sample paths room.gsc -o paths
  gsc-play stability room.gsc --trajectories paths --size 640x480 \
      --backend cpu --reuse error
      draws all paths, which are hard for reuse, and compares each frame with
      an exact picture; exit code 8 if a bound is exceeded)";

void addStabilityOptions(CLI::App& app, StabilityOptions& options)
{
    const Heading heading(app, "Judging");
    constexpr int64_t kMany = 1000000;
    constexpr double kMost = 1e9;
    addTexts(app, "--trajectories", options.trajectories, "FILE.json|DIR",
             "camera files to draw, or folders of them, such as gsc sample paths makes");
    addInteger(app, "--warmup", options.warmup, 0, kMany, "N (default: 5)",
               "frames at the start of each trajectory that statistics of time leave out");
    addBackend(app, "--reference", options.reference, false,
               "backend that draws the exact pictures (default: the tested one)")
        .rare();
    addScoreFrames(app, options.score);
    addNumber(app, "--bound-psnr", options.bound_psnr, {0, 1000}, " dB", "DB (default: 50)",
              "least PSNR that a frame may have, compared with exact pictures; 0 = no bound")
        .rare();
    addNumber(app, "--bound-temporal", options.bound_temporal, {0, kMost}, " medians", "X (default: 2)",
              "most that the error of a picture may change from one frame to the next, as a multiple of the "
              "trajectory's median change; less allows less flicker; 0 = no bound")
        .rare();
    addNumber(app, "--bound-p99", options.bound_p99, {0, kMost}, " medians", "X (default: 0)",
              "time that at most 1 of 100 frames may exceed, as a multiple of the median frame time; 0 = no bound")
        .rare();
    addText(app, "--out", options.out, "FILE.jsonl",
            "with --shard: file for the results, a line of JSON for each trajectory (schemas/run.schema.json); a shard "
            "that was stopped continues there. gsc merge-runs joins the files and exits with 8 if a bound is exceeded");
    addShard(app, options.play, "the trajectories", "--out");
}

ErrorCode runStability(const StabilityOptions& options, Reporter& report)
{
    const StabilitySummary summary = stability(options, report);
    report.endProgress(false);
    if (!report.json())
        report.text(stabilityText(options, summary));
    else
        for (const RunRow& row : summary.rows)
            report.text(jsonText(toJson(row), -1));
    // the outcome of a shard is left to gsc merge-runs, which has the rows of all shards
    return summary.passed() || options.play.shard.isGiven() ? ErrorCode::Ok : ErrorCode::Difference;
}

} // namespace

void addStabilityCommand(CLI::App& root, Invocation& invocation)
{
    auto options = std::make_shared<StabilityOptions>();
    CLI::App& command = addCommand(root, "stability", "Test the pictures of trajectories for errors and flicker");
    addFile(command, options->play);
    optionOf(command, "FILE").required();
    addStabilityOptions(command, *options);
    addCameraReading(command, options->play);
    addFrames(command, options->play);
    addViewOptions(command, options->play);
    addRunOptions(command, options->play);
    addWorkerOptions(command, options->play);
    addReporterOptions(command, invocation.reporter, true);
    setFooter(command, kStabilityExamples);
    onParsed(command, [&command, &invocation, options] {
        checkRenderOptions(command, options->play, true);
        checkEyes(command, options->play);
        checkWorkerOptions(command, options->play);
        checkEffect(command, "--out", options->play.shard.isGiven(), "--shard");
        checkShardFile(options->play, "--out", options->out);
        if (options->score.every > 1 && options->bound_temporal > 0)
            throw Error(ErrorCode::Usage,
                        formatString("--score-every %llu", static_cast<unsigned long long>(options->score.every)),
                        "leaves frames out, and --bound-temporal bounds changes from each frame to the next", "1",
                        "pass --bound-temporal 0 too");
        options->play.cameras.may_end_sooner = true; // stability() checks --frames with the longest trajectory
        invocation.run = [options](Reporter& report) { return runStability(*options, report); };
    });
}

} // namespace gsc
