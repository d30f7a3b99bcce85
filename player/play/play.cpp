// SPDX-License-Identifier: Apache-2.0
#include "player/play/play.h"

#include <gsc/error.h>
#include <gsc/interrupt.h>
#include "format/file/trained_model.h"
#include "player/devices/worker_report.h"
#include "player/frames/lod_target.h"
#include "runtime/cli/printed_command.h"
#include "runtime/frames/frame_loop.h"
#include "kernels/threads/stopwatch.h"
#include "player/devices/open_renderer.h"
#include "player/play/play_outputs.h"
#include "player/frames/shots.h"
#include "player/window/window.h"
#include <gsc/scene.h>

#include <chrono>
#include <memory>

namespace gsc {

namespace {

// Throws if the user interrupted the run. Images that were written so far are kept and complete.
void stopIfInterrupted(size_t frames, const PlaySummary& summary, const PlayOptions& options)
{
    if (!interrupted())
        return;
    const bool goes_on = options.shard.isGiven();
    throw Error(ErrorCode::Interrupted, "interrupted",
                formatString("stopped after %s of %s", formatCount(summary.frames.size()).c_str(),
                             formatCount(frames, "frame").c_str()),
                "to run to the end",
                formatString("run it again%s (%s written, all complete, and %s)", goes_on ? " to go on" : "",
                             formatCount(summary.images.size(), "image").c_str(),
                             goes_on ? ("their lines are in " + options.output.stats).c_str() : "no statistics file"));
}

[[noreturn]] void failIdle(const PlayOptions& options, const std::string& frames)
{
    const std::string file = shellWord(options.model.file);
    throw Error(
        ErrorCode::Usage, options.model.file, "nothing would be kept of " + frames, "an output",
        "add --out FOLDER, or " +
            (hasWindow() ? "on a desktop fly through it with gsc-play window " + file + ", or " : std::string()) +
            "measure with gsc-play bench " + file);
}

void noteFrame(Reporter& log, const FrameStats& stats)
{
    const StageTimes& t = stats.result.times;
    log.detail(formatString(
        "frame %llu %s: %.1f ms (select %.1f, decode %.1f, project %.1f, bin %.1f, sort %.1f, blend "
        "%.1f), %s, %s",
        static_cast<unsigned long long>(stats.frame), stats.camera.c_str(), t.total, t.select, t.decode, t.project,
        t.bin, t.sort, t.blend, formatCount(stats.result.eyes[0].anchors_visible, "anchor").c_str(),
        formatCount(stats.result.eyes[0].pairs + stats.result.eyes[1].pairs, "pair").c_str()));
}

} // namespace

bool isForSomething(const PlayOptions& options, const Reporter& log)
{
    return options.output.writes() || log.json() || log.options().verbose > 0;
}

PlaySummary play(const PlayOptions& options, Reporter& log)
{
    PlaySummary summary;
    FrameShard shard(options);
    const auto open_start = std::chrono::steady_clock::now();
    if (!isForSomething(options, log) && isTrainedModel(options.model.file))
        failIdle(options, "its cameras");
    const std::shared_ptr<const Scene> scene = openScene(options.model, options.devices, log);
    summary.open_ms = millisecondsSince(open_start);
    summary.file = {options.model.file, scene->bytes(), scene->anchorCount()};

    checkLevelOptions(*scene, options.model.file, options.frame);
    ShotFacts facts;
    const std::vector<Shot> shots = chooseShots(*scene, options.model.file, options.cameras, options.view, log, &facts);
    // a single shot is drawn once here, so it is no path; measurements draw it many times
    if (shots.size() == 1 && facts.no_path.empty())
        facts.no_path = "one camera of " + options.cameras.file + " is played";
    summary.frame = choiceOn(facts.no_path, options.frame, log);
    const FrameOptions drawn_with = frameOptions(*scene, summary.frame);
    if (!isForSomething(options, log))
        failIdle(options, formatCount(shots.size(), "camera"));
    PlayOutputs outputs(options, shots, shard, log);

    const std::unique_ptr<Renderer> renderer =
        openRenderer(options.model, options.devices, scene, log, summary.load_ms);
    summary.backend = deviceText(renderer->id());
    summary.tier = renderer->tierOf(options.frame.tier);
    std::optional<FrameGuard> guard = checkedGuard(*scene, options.model.file, summary.frame,
                                                   {drawsDetail(summary.frame, renderer->id().backend, summary.tier)});

    if (options.shard.isGiven())
        // without the device's number, because shards on one machine use a device each
        summary.backend = renderer->id().backend;
    shard.check(shots, summary.backend, summary.tier);
    outputs.open(facts.fps, log);
    summary.set_frames = shots.size();
    summary.shard_frames = shard.own();
    summary.frames_before = shard.own() - shard.frames().size();

    const auto eye_count = uint32_t(options.view.eyes);
    const std::vector<size_t>& frames = shard.frames();
    FrameLoop loop(*scene, shots, eye_count, drawn_with, *renderer, guard ? &*guard : nullptr);
    const auto prepare = [&](size_t, LoopFrame& frame) {
        stopIfInterrupted(frames.size(), summary, options);
        frame.drawToHost();
    };
    const auto done = [&](size_t n, LoopFrame& drawn, const TimedFrame& frame) {
        stopIfInterrupted(frames.size(), summary, options);
        const Shot& shot = *drawn.shot;
        const FrameStats stats{shot.index,        shot.camera.name,   summary.backend, summary.tier,
                               shot.camera.width, shot.camera.height, eye_count,       shot.appearance,
                               frame.result,      frame.lod_bias,     frame.detail};
        for (std::string& path : outputs.add(frames[n], drawn, frameStatsJson(stats)))
            summary.images.push_back(std::move(path));
        noteFrame(log, stats);
        summary.frames.push_back(frame);
        log.progress("render", summary.frames.size(), frames.size());
    };
    // with a time target, the time of a frame decides the settings of the next, so none is drawn ahead
    const size_t ahead = guard ? 1 : renderer->framesInFlight();
    loop.run(
        frames.size(), ahead, [&](size_t n) { return frames[n]; }, prepare, done);
    summary.service = serviceStats(*renderer);
    outputs.commit();
    return summary;
}

} // namespace gsc
