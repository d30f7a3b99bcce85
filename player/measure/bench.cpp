// SPDX-License-Identifier: Apache-2.0
#include "player/measure/bench.h"

#include <gsc/error.h>
#include <gsc/interrupt.h>
#include "player/devices/worker_report.h"
#include "player/frames/lod_target.h"
#include "player/measure/bench_scores.h"
#include "player/frames/stopwatch.h"
#include "player/devices/open_renderer.h"
#include "player/devices/worker_options.h"
#include "runtime/records/row_file.h"
#include "player/frames/shots.h"
#include <gsc/scene.h>
#include "runtime/service/service_renderer.h"
#include "player/measure/bench_rows.h"

#include <algorithm>
#include <chrono>
#include <deque>
#include <memory>

namespace gsc {

namespace {

using Clock = std::chrono::steady_clock;

class Bench {
public:
    Bench(const BenchOptions& options, const Scene& scene, Renderer& renderer, const std::vector<Shot>& shots)
        : m_options(options.play), m_in_flight(options.in_flight), m_scene(scene), m_renderer(renderer), m_shots(shots),
          m_frame(frameOptions(scene, options.play.frame)), m_control(lodControl(scene, options.play.frame))
    {
    }

    // Begins frame `i` of a run that goes round the shots.
    void begin(uint64_t i)
    {
        throwIfInterrupted();
        const Shot& shot = m_shots[i % m_shots.size()];
        m_frame.appearance = shotAppearance(m_scene, shot);
        if (m_control)
            m_frame.lod_bias = float(m_control->bias());
        Begun& begun = m_begun.emplace_back();
        shotEyes(shot, eyeCount(), begun.eyes);
        begun.request = {{begun.eyes, eyeCount()}, {}, m_frame};
        begun.pixels = double(shot.camera.width) * shot.camera.height;
        begun.start = Clock::now();
        begun.ticket = m_renderer.submit(begun.request);
    }

    [[nodiscard]] bool full() const { return m_begun.size() >= m_in_flight; }

    // Ends the frame begun first.
    TimedFrame end()
    {
        const Begun& begun = m_begun.front();
        TimedFrame frame{0, finish(m_renderer, begun.request, begun.ticket), begun.pixels,
                         double(begun.request.options.lod_bias)};
        const Clock::time_point now = Clock::now();
        frame.wall_ms = std::chrono::duration<double, std::milli>(now - std::max(begun.start, m_last_end)).count();
        m_last_end = now;
        if (m_control)
            m_control->add(frame.result.times.total);
        m_begun.pop_front();
        return frame;
    }

private:
    [[nodiscard]] uint32_t eyeCount() const { return uint32_t(m_options.view.eyes); }

    struct Begun {
        EyeParams eyes[kMaxEyes] = {};
        FrameRequest request;
        double pixels = 0;
        Clock::time_point start;
        uint64_t ticket = 0;
    };

    const PlayOptions& m_options;
    uint32_t m_in_flight;
    const Scene& m_scene;
    Renderer& m_renderer;
    std::deque<Begun> m_begun;
    Clock::time_point m_last_end{};
    const std::vector<Shot>& m_shots;
    FrameOptions m_frame;
    std::optional<LodControl> m_control;
};

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
        throw Error(ErrorCode::Usage,
                    formatString("--frames-in-flight %u: these devices take at most %u, expected that "
                                 "or fewer; pass a smaller number",
                                 options.in_flight, most));
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
    const std::vector<Shot> shots =
        chooseShots(*scene, options.play.model.file, options.play.cameras, options.play.view, log);
    summary.shots = shots.size();
    if (options.scores_path)
        checkScored(options.score, {options.play.cameras.file, {}, shots}, "--score-first");

    const std::unique_ptr<Renderer> renderer =
        openRenderer(options.play.model, options.play.devices, scene, log, summary.load_ms);
    summary.backend = deviceText(renderer->id());
    summary.ipd = shots.front().ipd;

    Bench run(options, *scene, *renderer, shots);
    const uint64_t total = uint64_t(options.warmup) + options.measured;
    for (uint64_t begun = 0, ended = 0; ended < total; ++ended) {
        // the measured frames start at the first shot whatever the warm-up was
        for (; begun < total && !run.full(); ++begun)
            run.begin(begun >= options.warmup ? begun - options.warmup : begun);
        const TimedFrame frame = run.end();
        if (ended >= options.warmup)
            summary.frames.push_back(frame);
        else
            summary.warm_bytes = std::max(summary.warm_bytes, frame.result.bytes_resident);
        log.progress("render", ended + 1, total);
    }
    summary.service = serviceStats(*renderer);
    summary.device = renderer->device();
    summary.tier = renderer->tierOf(options.play.frame.tier);
    summary.anchor_cost = anchorCost(scene->view(), summary.tier);
    summary.ceilings = ceilingsOf(*renderer, log);

    if (scores(options))
        scoreBench(options, scene, shots, *renderer, summary, log);
    summary.warnings = log.warnings();
    return summary;
}

} // namespace gsc
