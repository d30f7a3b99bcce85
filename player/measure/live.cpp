// SPDX-License-Identifier: Apache-2.0
#include "player/measure/live.h"

#include <gsc/error.h>
#include <gsc/file/output_file.h>
#include <gsc/file/output_paths.h>
#include <gsc/interrupt.h>
#include "format/machine/threads.h"
#include "player/devices/open_renderer.h"
#include "player/devices/open_service.h"
#include "player/frames/lod_target.h"
#include "player/frames/shots.h"
#include <gsc/scene.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <optional>
#include <thread>

namespace gsc {

namespace {

using Clock = std::chrono::steady_clock;

constexpr size_t kTraced = 1000000; // most poses, and most events, in the trace

// Thread that takes finished pictures, as a display does, and releases them.
class Display {
public:
    explicit Display(RendererService& service)
        : m_thread(startThread<std::thread>("live", [this, &service] { run(service); }))
    {
    }
    ~Display() { stop(); }
    Display(const Display&) = delete;
    Display& operator=(const Display&) = delete;

    void stop()
    {
        m_ends = true;
        if (m_thread.joinable())
            m_thread.join();
    }
    [[nodiscard]] uint64_t shown() const { return m_shown; }

private:
    void run(RendererService& service)
    {
        constexpr auto kAsk = std::chrono::milliseconds(5);
        while (!m_ends || service.stats().counts.open() > 0) {
            if (service.next(kAsk))
                ++m_shown;
            else if (service.stats().counts.open() == 0)
                std::this_thread::sleep_for(std::chrono::microseconds(200)); // no pose is under way
        }
    }

    std::atomic<bool> m_ends = false;
    std::atomic<uint64_t> m_shown = 0;
    std::thread m_thread; // last, because it uses the other members
};

// Checks --trace, before the model is read. Throws Error.
void checkTrace(const LiveOptions& options, Reporter& log)
{
    if (options.trace.empty())
        return;
    checkStandardOutput(options.trace, "--trace", log.json());
    std::vector<NamedPath> inputs = {{options.play.model.file, "the model"}};
    if (options.play.cameras.isFile())
        inputs.push_back({options.play.cameras.file, "the camera file"});
    const NamedPath trace{options.trace, "--trace"};
    checkOutputsDiffer(std::span(&trace, 1), inputs);
}

void setLive(const LiveOptions& options, ServiceOptions& service)
{
    service.timeout = std::chrono::nanoseconds(int64_t(options.timeout_ms * 1e6));
    service.still_distance = options.still_distance;
    service.still_degrees = options.still_degrees;
    service.trace_limit = kTraced;
}

// Throws if the run showed nothing: no worker was left, or no pose could be drawn.
void throwIfFailed(const LiveOptions& options, const ServiceStats& stats)
{
    const auto last = std::ranges::find_if(stats.workers.rbegin(), stats.workers.rend(),
                                           [](const WorkerStats& worker) { return !worker.last_fault.empty(); });
    const std::string because = last == stats.workers.rend() ? "" : ", the last because: " + last->last_fault;
    if (allGone(stats))
        throw Error(ErrorCode::Device, options.play.model.file, "no worker is left" + because, "one",
                    "look at --list-devices and start again");
    if (stats.counts.of(PoseEnd::Shown) == 0 && stats.counts.of(PoseEnd::Failed) > 0)
        throw Error(ErrorCode::Device, options.play.model.file,
                    formatString("no pose was shown and %llu failed%s",
                                 static_cast<unsigned long long>(stats.counts.of(PoseEnd::Failed)), because.c_str()),
                    "pictures", "render one frame with gsc-play to see why");
}

} // namespace

LiveSummary live(const LiveOptions& options, Reporter& log)
{
    const PlayOptions& play = options.play;
    checkTrace(options, log);
    LiveSummary summary;
    const std::shared_ptr<const Scene> scene = openScene(play.model, play.devices, log);
    summary.file = {play.model.file, scene->bytes(), scene->anchorCount()};
    checkLevelOptions(*scene, play.model.file, play.frame);
    ShotFacts facts;
    const std::vector<Shot> shots = chooseShots(*scene, play.model.file, play.cameras, play.view, log, &facts);
    FrameOptions frame = frameOptions(*scene, choiceOn(facts.no_path, play.frame, log));

    std::optional<OutputFile> file;
    if (!options.trace.empty())
        file.emplace(options.trace, OutputKind::Text, play.output.overwrite);
    const OpenedService opened = openService(
        scene, play.model, play.devices, [&options](ServiceOptions& service) { setLive(options, service); }, log);
    RendererService& service = *opened.service;
    summary.devices = opened.devices;
    summary.tier = service.tierOf(play.frame.tier);

    const uint64_t poses = options.seconds > 0 ? uint64_t(std::ceil(options.seconds * options.rate)) : shots.size();
    const auto eye_count = uint32_t(play.view.eyes);
    Display display(service);
    const Clock::time_point start = Clock::now();
    uint64_t shown_before = 0;
    double said = 0;
    for (uint64_t i = 0; i < poses; ++i) {
        throwIfInterrupted();
        const double due = double(i) / options.rate;
        std::this_thread::sleep_until(start +
                                      std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(due)));
        const Shot& shot = shots[i % shots.size()];
        EyeParams eyes[kMaxEyes];
        shotEyes(shot, eye_count, eyes);
        frame.appearance = shotAppearance(*scene, shot);
        PoseRequest request;
        request.eyes.assign(eyes, eyes + eye_count);
        request.options = frame;
        request.on_device = true;
        (void)service.submit(request);
        if (due - said >= 0.5) {
            const uint64_t shown = display.shown();
            const ServiceStats stats = service.stats();
            if (allGone(stats))
                break;
            log.progressPart(
                formatString("%.0f fps, %u working", double(shown - shown_before) / (due - said), stats.working));
            shown_before = shown;
            said = due;
        }
        log.progress("live", i + 1, poses);
    }
    display.stop();
    summary.seconds = std::chrono::duration<double>(Clock::now() - start).count();
    summary.service = service.stats();
    summary.trace = service.trace();
    summary.warnings = log.warnings();
    if (file) {
        file->write(jsonText(toJson(liveTrace(options, summary)), -1) + "\n");
        file->commit();
    }
    throwIfFailed(options, summary.service); // after the trace is written: that of a failed run is useful too
    return summary;
}

} // namespace gsc
