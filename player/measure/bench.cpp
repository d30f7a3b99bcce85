// SPDX-License-Identifier: Apache-2.0
#include "player/measure/bench.h"

#include <gsc/error.h>
#include "player/devices/worker_report.h"
#include "player/frames/lod_target.h"
#include "player/measure/bench_scores.h"
#include "kernels/threads/stopwatch.h"
#include "player/devices/open_renderer.h"
#include "player/devices/worker_options.h"
#include "runtime/records/row_file.h"
#include "player/frames/shots.h"
#include "runtime/frames/frame_loop.h"
#include <gsc/scene.h>
#include "runtime/service/service_renderer.h"
#include "player/measure/bench_rows.h"

#include <algorithm>
#include <chrono>
#include <memory>

namespace gsc {

namespace {

using Clock = std::chrono::steady_clock;

// A device whose memory the model fills has no room left to measure in; the frames are measured all the same.
DeviceCeilings ceilingsOf(Renderer& renderer, Reporter& log)
{
    try {
        return renderer.ceilings();
    } catch (const Error& e) {
        if (e.code() != ErrorCode::OutOfMemory)
            throw;
        log.warning(formatString("no floors: the device's ceilings could not be measured: %s", e.what()));
        return {};
    }
}

// Before the model is loaded.
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

BenchSummary bench(const BenchOptions& options, Reporter& log)
{
    std::vector<NamedPath> inputs;
    if (options.play.cameras.isFile())
        inputs.push_back({options.play.cameras.file, "the camera file"});
    checkRowOutput(options, inputs, log.json());
    if (const RowFile rows = readBenchRows(options.out); !rows.cut_off.empty())
        log.warning(rows.cut_off);
    checkFramesInFlight(options);
    BenchSummary summary;
    const Clock::time_point open_start = Clock::now();
    const std::shared_ptr<const Scene> scene = openScene(options.play.model, options.play.devices);
    summary.open_ms = millisecondsSince(open_start);
    summary.file = {options.play.model.file, scene->bytes(), scene->anchorCount()};
    checkLevelOptions(*scene, options.play.model.file, options.play.frame);
    ShotFacts facts;
    const std::vector<Shot> shots =
        chooseShots(*scene, options.play.model.file, options.play.cameras, options.play.view, log, &facts);
    summary.frame = choiceOn(facts.no_path, options.play.frame, log);
    summary.shots = shots.size();
    if (options.scores_path)
        checkScored(options.score, {options.play.cameras.file, {}, shots, 1, {}}, "--score-first");

    const std::unique_ptr<Renderer> renderer =
        openRenderer(options.play.model, options.play.devices, scene, log, summary.load_ms);
    summary.backend = deviceText(renderer->id());
    summary.ipd = shots.front().ipd;

    summary.tier = renderer->tierOf(options.play.frame.tier);
    std::optional<FrameGuard> guard = checkedGuard(*scene, options.play.model.file, summary.frame,
                                                   {drawsDetail(summary.frame, renderer->id().backend, summary.tier)});
    FrameLoop loop(*scene, shots, uint32_t(options.play.view.eyes), frameOptions(*scene, summary.frame), *renderer,
                   guard ? &*guard : nullptr);
    const uint64_t total = uint64_t(options.warmup) + options.measured;
    // the measured frames start at the first shot whatever the warm-up was
    const auto shot_of = [&](size_t i) { return (i >= options.warmup ? i - options.warmup : i) % shots.size(); };
    loop.run(total, options.in_flight, shot_of, nullptr, [&](size_t i, LoopFrame&, const TimedFrame& frame) {
        if (i >= options.warmup)
            summary.frames.push_back(frame);
        else
            summary.warm_bytes = std::max(summary.warm_bytes, frame.result.bytes_resident);
        log.progress("render", i + 1, total);
    });
    summary.service = serviceStats(*renderer);
    summary.device = renderer->device();
    summary.anchor_cost = anchorCost(scene->view(), summary.tier);
    summary.ceilings = ceilingsOf(*renderer, log);

    if (scores(options))
        scoreBench(options, scene, shots, *renderer, summary, log);
    summary.warnings = log.warnings();
    return summary;
}

} // namespace gsc
