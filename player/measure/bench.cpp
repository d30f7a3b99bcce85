// SPDX-License-Identifier: Apache-2.0
#include "player/measure/bench.h"

#include <gsc/error.h>
#include "runtime/cli/setting_words.h"
#include <gsc/scene.h>
#include "kernels/threads/stopwatch.h"
#include "player/devices/open_renderer.h"
#include "player/devices/worker_options.h"
#include "player/devices/worker_report.h"
#include "player/frames/content_hash.h"
#include "player/frames/lod_target.h"
#include "player/measure/bench_scores.h"
#include "player/measure/row_output.h"
#include "player/measure/work_facts.h"
#include "runtime/frames/frame_loop.h"
#include "runtime/records/row_file.h"
#include "runtime/records/row_lines.h"
#include "runtime/service/service_renderer.h"

#include <algorithm>
#include <chrono>
#include <memory>

namespace gsc {

namespace {

using Clock = std::chrono::steady_clock;

// Ceilings of the device; unknown, with a warning, if the model leaves no memory to measure them in.
DeviceCeilings ceilingsOf(Renderer& renderer, Reporter& log)
{
    try {
        return renderer.ceilings();
    } catch (const Error& e) {
        if (e.code() != ErrorCode::OutOfMemory)
            throw;
        log.warning(formatString("no floors: the device's ceilings could not be measured: %s", warningText(e).c_str()));
        return {};
    }
}

// Throws Error(Usage) for too many frames in flight, before the model is loaded.
void checkFramesInFlight(const BenchOptions& options)
{
    const uint32_t most = drawsWithService(options.play.devices)
                              ? serviceFramesInFlight(workerDevices(options.play.devices).size())
                              : kFramesInFlight;
    if (options.in_flight > most)
        throw Error(ErrorCode::Usage, formatString("--frames-in-flight %u", options.in_flight),
                    formatString("these devices take at most %u", most), "that or fewer", "pass a smaller number");
}

} // namespace

RunRow bench(const BenchOptions& options, Reporter& log)
{
    const PlayOptions& play = options.play;
    std::vector<NamedPath> inputs = {{play.model.file, "the model"}};
    if (play.cameras.isFile())
        inputs.push_back({play.cameras.file, "the camera file"});
    checkRowOutput(options.out, inputs, log.json());
    const RowFile rows(options.out, kRunRow, [](const OrderedJson& json, const std::string& where) {
        if (const RunRow row = runRowOf(json, where); row.shard || row.stability || row.curve)
            refuseMixed(where, row);
    });
    if (!rows.cutOff().empty())
        log.warning(rows.cutOff());
    checkFramesInFlight(options);
    const Clock::time_point open_start = Clock::now();
    const std::shared_ptr<const Scene> scene = openScene(play.model, play.devices);
    const double open_ms = millisecondsSince(open_start);
    checkLevelOptions(*scene, play.model.file, play.frame);
    const Path path = openPath(*scene, play.model.file, play.cameras, play.view, play.cameras.file, log);
    RunConfig run{choiceOn(path.no_path, play.frame, log), {}, false};
    if (options.scores_path)
        checkScored(options.score, path, "--score-first");

    double load_ms = 0;
    const std::unique_ptr<Renderer> renderer = openRenderer(play.model, play.devices, scene, log, load_ms);
    // the name that a sweep gives it, so that their rows are compared
    run.backend = play.devices.device == 0 ? renderer->id().backend : deviceText(renderer->id());
    RunResult result;
    result.tier = renderer->tierOf(play.frame.tier);
    std::optional<FrameGuard> guard =
        checkedGuard(*scene, play.model.file, run, {drawsDetail(run, renderer->id().backend, result.tier)});
    FrameLoop loop(*scene, path.shots, path.eye_count, frameOptions(*scene, run), *renderer, guard ? &*guard : nullptr);
    const uint64_t total = uint64_t(options.warmup) + options.measured;
    WorkContext work{run, path.eye_count, 0, {}, {}};
    // measured frames start at the first shot, whatever the length of the warm-up
    const auto shot_of = [&](size_t i) { return (i >= options.warmup ? i - options.warmup : i) % path.shots.size(); };
    loop.run(total, options.in_flight, shot_of, nullptr, [&](size_t i, LoopFrame&, const TimedFrame& frame) {
        if (i >= options.warmup)
            result.frames.push_back(frame);
        else
            work.warm_bytes = std::max(work.warm_bytes, frame.result.bytes_resident);
        log.progress("render", i + 1, total);
    });
    const std::optional<ServiceStats> service = serviceStats(*renderer);
    result.device = renderer->device(); // read after the last frame, so that its clocks are those of the run
    work.anchor_cost = anchorCost(scene->view(), result.tier);
    work.ceilings = ceilingsOf(*renderer, log);

    RunContext context;
    context.view = play.view;
    context.devices = play.devices;
    context.appearance = play.cameras.appearance;
    context.label = options.label;
    context.file = {play.model.file, scene->bytes(), scene->anchorCount()};
    context.file_hash = fileHash(play.model.file);
    context.warmup = options.warmup;
    context.measured = options.measured;
    context.in_flight = options.in_flight;
    if (scores(options))
        result.accuracy = scoreBench(options, scene, path, run, *renderer, context, log);
    RunRow row = runRow(context, rowConfig(context, path, run), run.backend, result);
    row.open_ms = open_ms;
    row.load_ms = load_ms;
    row.work = workFacts(work, result.frames);
    row.service = serviceFacts(service);
    row.warnings = log.warnings();
    return row;
}

} // namespace gsc
