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
#include <cmath>
#include <limits>
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

// Tells when the median is as sure as --until-steady asks.
class SteadyCheck {
public:
    SteadyCheck(const BenchOptions& options, size_t cameras)
        : m_bound(options.until_steady), m_most(options.measured), m_cameras(cameras), m_frames(options.measured)
    {
    }

    [[nodiscard]] uint64_t frames() const { return m_frames; } // frames to measure, as far as is known

    // Looks after whole rounds of the cameras, at least kLeast frames and a twentieth more than the last time.
    bool isReachedBy(TimedFrames frames)
    {
        constexpr size_t kLeast = 30;
        const size_t count = frames.size();
        if (m_bound == 0 || count < kLeast || count % m_cameras != 0 || count < m_next || m_percent <= m_bound)
            return false;
        m_next = count + count / 20;
        m_percent = percentOfMedian(frames);
        // the range narrows with the root of the number of frames
        const double ratio = m_percent / m_bound, needed = double(count) * std::max(1.0, ratio * ratio);
        m_frames = uint64_t(std::min(needed, double(m_most)));
        return m_percent <= m_bound;
    }

    // `frames`: all that were measured, whose number need be no whole round
    void warnUnlessReached(TimedFrames frames, Reporter& log) const
    {
        if (m_bound == 0 || m_percent <= m_bound)
            return;
        const double percent = percentOfMedian(frames);
        if (percent <= m_bound)
            return;
        const std::string count = formatCount(frames.size(), "frame");
        const std::string known = std::isfinite(percent)
                                      ? formatString("the median is known to %.2g %% after ", percent) + count
                                      : count + " do not tell";
        log.warning(formatString("--until-steady %g: %s; --measure more, or ask for less", m_bound, known.c_str()));
    }

private:
    // The range of the median in per cent of it, as the report has it; infinite if the frames are too few.
    [[nodiscard]] double percentOfMedian(TimedFrames frames) const
    {
        const std::optional<MedianRange> range = medianRange(frames, m_cameras);
        return range ? percentOf(*range, spreadOf(frames, &TimedFrame::wall_ms).median)
                     : std::numeric_limits<double>::infinity();
    }

    double m_bound, m_percent = std::numeric_limits<double>::infinity();
    uint64_t m_most;
    size_t m_cameras, m_next = 0;
    uint64_t m_frames;
};

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
    const std::shared_ptr<const Scene> scene = openScene(play.model, play.devices, log);
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
    const FrameOptions drawn_with = frameOptions(*scene, run);
    FrameLoop loop(*scene, path.shots, path.eye_count, drawn_with, *renderer, guard ? &*guard : nullptr);
    const uint64_t frames = uint64_t(options.warmup) + options.measured;
    const uint64_t to_score =
        scores(options) ? scoreSteps(options, path.shots.size(), dependsOnPath(drawn_with) || guard) : 0;
    SteadyCheck steady(options, path.shots.size());
    WorkContext work{run, path.eye_count, path.shots.size(), 0, {}, {}};
    // measured frames start at the first shot, whatever the length of the warm-up
    const auto shot_of = [&](size_t i) { return (i >= options.warmup ? i - options.warmup : i) % path.shots.size(); };
    loop.run(frames, options.in_flight, shot_of, nullptr, [&](size_t i, LoopFrame&, const TimedFrame& frame) {
        if (i >= options.warmup)
            result.frames.push_back(frame);
        else
            work.warm_bytes = std::max(work.warm_bytes, frame.result.bytes_resident);
        if (steady.isReachedBy(result.frames))
            loop.stop();
        log.progress("render", i + 1, options.warmup + steady.frames() + to_score);
    });
    const uint64_t drawn = options.warmup + result.frames.size();
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
    context.until_steady = options.until_steady;
    context.in_flight = options.in_flight;
    if (scores(options))
        result.accuracy = scoreBench(options, scene, path, run, *renderer, context, log,
                                     [&](uint64_t done) { log.progress("render", drawn + done, drawn + to_score); });
    RowConfig config = rowConfig(context, path, run);
    config.frames = result.frames.size(); // fewer than `measured` if the median is steady sooner
    RunRow row = runRow(context, config, run.backend, result);
    row.open_ms = open_ms;
    row.load_ms = load_ms;
    row.work = workFacts(work, result.frames);
    row.service = serviceFacts(service);
    steady.warnUnlessReached(result.frames, log);
    row.warnings = log.warnings();
    return row;
}

} // namespace gsc
