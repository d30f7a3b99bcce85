// SPDX-License-Identifier: Apache-2.0
#include <gsc/error.h>
#include "player/commands/commands.h"
#include "player/commands/render_options.h"
#include "player/measure/live.h"
#include "runtime/cli/options.h"
#include "player/commands/worker_flags.h"

#include <memory>

namespace gsc {

namespace {

constexpr const char* kLiveExamples = R"(examples:
  gsc-play live city.gsc --cameras zoom-out.json --eyes 2 --size 2048x2048 \
      --fov 90 --gpus all --rate 100 --min-fps 90
      poses come 100 times a second; a GPU joins before the rate falls below 90
  gsc-play live room.gsc --rate 72 --seconds 60 --devices cuda:0,cuda:1 \
      --mode split --trace run.json
      a minute round the stored cameras on two GPUs; gsc chart draws run.json

Camera poses arrive in real time. The newest waiting pose is drawn next, the
newest drawn picture is shown, as a viewer would do; here there is no screen.
Each pose ends as shown, late (a newer one was shown before it), expired (a
newer one came before it was drawn, or it waited too long) or failed.)";

void addLiveOptions(CLI::App& app, LiveOptions& options)
{
    const Heading heading(app, "Poses in real time");
    addNumber(app, "--rate", options.rate, {0.1, 10000}, " poses per second", "FPS (default: 90)",
              "camera poses played each second");
    addNumber(app, "--seconds", options.seconds, {0, 1e6}, " seconds", "S (default: 0)",
              "length of the run, going round the cameras; 0 = once through them");
    addNumber(app, "--timeout-ms", options.timeout_ms, {0, 1e6}, " milliseconds", "MS (default: 50)",
              "longest time that a pose may wait to be drawn before it is dropped; 0 = until a newer pose comes")
        .rare();
    addNumber(app, "--still-distance", options.still_distance, {0, 1e6}, " world units", "LENGTH (default: 0)",
              "distance in world units that the eyes may move and still keep the last picture, if they also turn by "
              "--still-degrees at most: the pose is not drawn; both 0 = draw every pose")
        .rare();
    addNumber(app, "--still-degrees", options.still_degrees, {0, 180}, " degrees", "DEGREES (default: 0)",
              "angle that the eyes may turn and still keep the last picture, see --still-distance")
        .rare();
    addText(app, "--trace", options.trace, "FILE.json",
            "file to write a trace to: every pose, and each start and stop of a device with its cause "
            "(schemas/service-trace.schema.json); gsc chart draws it");
    addFlag(app, "-w,--overwrite", options.play.output.overwrite, "replace the trace file if it exists");
}

ErrorCode runLive(const LiveOptions& options, Reporter& report)
{
    const LiveSummary summary = live(options, report);
    report.endProgress(false);
    if (report.json()) {
        ServiceTraceReport trace = liveTrace(options, summary);
        trace.poses.clear(); // the file of --trace holds the poses
        report.object(toJson(trace));
    } else {
        report.text(liveReportText(options, summary));
    }
    return ErrorCode::Ok;
}

} // namespace

void addLiveCommand(CLI::App& root, Invocation& invocation)
{
    auto options = std::make_shared<LiveOptions>();
    CLI::App& command =
        addCommand(root, "live", "Play a trajectory in real time and report what a viewer would have seen");
    addFile(command, options->play);
    optionOf(command, "FILE").required();
    addLiveOptions(command, *options);
    addCameras(command, options->play);
    addFrames(command, options->play);
    addViewOptions(command, options->play);
    addRunOptions(command, options->play);
    addWorkerOptions(command, options->play);
    addReporterOptions(command, invocation.reporter, true);
    setFooter(command, kLiveExamples);
    onParsed(command, [&command, &invocation, options] {
        checkRenderOptions(command, options->play, false);
        checkWorkerOptions(command, options->play);
        checkEffect(command, "--overwrite", !options->trace.empty(), "--trace");
        invocation.run = [options](Reporter& report) { return runLive(*options, report); };
    });
}

} // namespace gsc
