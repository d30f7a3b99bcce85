// SPDX-License-Identifier: Apache-2.0
#include "player/play/play.h"

#include <gsc/error.h>
#include <gsc/interrupt.h>
#include <gsc/file/output_file.h>
#include <gsc/file/output_paths.h>
#include "player/devices/worker_report.h"
#include "player/frames/lod_target.h"
#include "player/output/video_file.h"
#include "runtime/frames/frame_loop.h"
#include "player/frames/stopwatch.h"
#include "player/devices/open_renderer.h"
#include "player/output/out_pattern.h"
#include "player/shard/frame_shard.h"
#include "player/frames/shots.h"
#include <gsc/scene.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <memory>

namespace gsc {

namespace {

// Paths of the images, checked before anything is rendered; their folders exist afterwards.
std::vector<std::string> prepareOutputs(const std::vector<Shot>& shots, const PlayOptions& options, FrameShard& shard,
                                        Reporter& log)
{
    namespace fs = std::filesystem;
    std::vector<std::string> paths;
    if (!options.output.out.empty() && !isStandardOutput(options.output.out)) {
        std::vector<OutputFrame> named;
        for (const Shot& shot : shots)
            named.push_back({shot.camera.name, shot.index});
        paths = outputPaths(options.output.out, named, options.view.eyes);
    }
    std::vector<NamedPath> outputs, inputs = {{options.model.file, "the model"}};
    for (const std::string& path : paths)
        outputs.push_back({path, "an image of --out"});
    if (!options.output.stats.empty())
        outputs.push_back({options.output.stats, "--stats"});
    if (!options.output.video.empty())
        outputs.push_back({options.output.video, "--video"});
    if (options.cameras.isFile())
        inputs.push_back({options.cameras.file, "the camera file"});
    checkStandardOutput(options.output.stats, "--stats", log.json());
    checkStandardOutput(options.output.out, "--out", log.json());
    checkOutputsDiffer(outputs, inputs);
    shard.plan(shots.size(), paths, log);
    for (const size_t frame : shard.frames())
        for (size_t eye = 0; eye < size_t(options.view.eyes) && !paths.empty(); ++eye)
            checkOutput(paths[frame * size_t(options.view.eyes) + eye], OutputKind::Binary, shard.mayReplace(frame),
                        OutputFolder::IsMade);
    if (!options.output.stats.empty())
        checkOutput(options.output.stats, OutputKind::Text, options.output.overwrite || options.shard.isGiven(),
                    OutputFolder::IsMade);
    if (!options.output.video.empty()) {
        checkVideoProgram();
        checkOutput(options.output.video, OutputKind::Binary, options.output.overwrite, OutputFolder::IsMade);
    }
    if (!paths.empty())
        loadImageWriter(paths.front());
    for (const NamedPath& file : outputs) {
        const fs::path folder = fs::path(file.path).parent_path();
        std::error_code code;
        if (!folder.empty() && !fs::is_directory(folder, code) && !fs::create_directories(folder, code) && code)
            throw Error(
                ErrorCode::Io,
                formatString("%s: cannot be created (%s), expected a folder that may be written; choose another "
                             "place or change its rights",
                             folder.string().c_str(), code.message().c_str()));
    }
    return paths;
}

void warnOfOddSides(const std::string& path, uint32_t width, uint32_t height, Reporter& log)
{
    if (width % 2 == 0 && height % 2 == 0)
        return;
    log.warning(formatString("%s: pictures of %u x %u pixels, of which browsers play even sides only; the video has "
                             "%u x %u, because its last %s repeated",
                             path.c_str(), width, height, width + width % 2, height + height % 2,
                             height % 2 == 0  ? "column is"
                             : width % 2 == 0 ? "row is"
                                              : "column and row are"));
}

// Takes the pictures of every frame behind those of the one before.
struct Streams {
    std::optional<PictureStream> output; // standard output
    std::optional<VideoFile> video;

    // Throws Error(Usage) where pictures are of different sizes.
    Streams(const std::vector<Shot>& shots, const PlayOptions& options, Reporter& log)
    {
        if (!isStandardOutput(options.output.out) && options.output.video.empty())
            return;
        const Camera& first = shots.front().camera;
        for (const Shot& shot : shots)
            if (shot.camera.width != first.width || shot.camera.height != first.height)
                throw Error(ErrorCode::Usage,
                            formatString("%s: camera %s has %u x %u pixels, expected %u x %u as all before it; choose "
                                         "one --size for all, or write files",
                                         options.output.video.empty() ? "--out -" : "--video", shot.camera.name.c_str(),
                                         shot.camera.width, shot.camera.height, first.width, first.height));
        const auto eyes = uint32_t(options.view.eyes);
        if (isStandardOutput(options.output.out))
            output.emplace(options.output.stream, first.width, first.height, eyes, options.output.fps,
                           standardOutputSink());
        if (options.output.video.empty())
            return;
        video.emplace(options.output.video, first.width, first.height, eyes, options.output.fps,
                      options.output.overwrite);
        warnOfOddSides(options.output.video, first.width * eyes, first.height, log);
    }

    void add(std::span<const Image> eyes)
    {
        if (output)
            output->add(eyes);
        if (video)
            video->add(eyes);
    }
};

// Images are kept, each is whole.
void stopIfInterrupted(size_t frames, const PlaySummary& summary, const PlayOptions& options)
{
    if (!interrupted())
        return;
    const bool goes_on = options.shard.isGiven();
    throw Error(ErrorCode::Interrupted,
                formatString("interrupted: stopped after %zu of %zu frames, expected to run to the end; run it "
                             "again%s (%zu image%s written, all complete, and %s)",
                             summary.frames.size(), frames, goes_on ? " to go on" : "", summary.images.size(),
                             summary.images.size() == 1 ? " was" : "s were",
                             goes_on ? ("their lines are in " + options.output.stats).c_str() : "no statistics file"));
}

void noteFrame(Reporter& log, const FrameStats& stats)
{
    const StageTimes& t = stats.result.times;
    log.detail(formatString(
        "frame %llu %s: %.1f ms (select %.1f, decode %.1f, project %.1f, bin %.1f, sort %.1f, blend "
        "%.1f), %llu anchors, %llu pairs",
        static_cast<unsigned long long>(stats.frame), stats.camera.c_str(), t.total, t.select, t.decode, t.project,
        t.bin, t.sort, t.blend, static_cast<unsigned long long>(stats.result.eyes[0].anchors_visible),
        static_cast<unsigned long long>(stats.result.eyes[0].pairs + stats.result.eyes[1].pairs)));
}

} // namespace

PlaySummary play(const PlayOptions& options, Reporter& log)
{
    PlaySummary summary;
    FrameShard shard(options);
    const auto open_start = std::chrono::steady_clock::now();
    const std::shared_ptr<const Scene> scene = openScene(options.model, options.devices);
    summary.open_ms = millisecondsSince(open_start);
    summary.file = {options.model.file, scene->bytes(), scene->anchorCount()};

    checkLevelOptions(*scene, options.model.file, options.frame);
    const std::vector<Shot> shots = chooseShots(*scene, options.model.file, options.cameras, options.view, log);
    std::optional<LodControl> control = lodControl(*scene, options.frame);
    const std::vector<std::string> paths = prepareOutputs(shots, options, shard, log);
    std::optional<OutputFile> stats_file;
    if (!options.output.stats.empty() && !options.shard.isGiven())
        stats_file.emplace(options.output.stats, OutputKind::Text, options.output.overwrite);

    Streams streams(shots, options, log);

    const std::unique_ptr<Renderer> renderer =
        openRenderer(options.model, options.devices, scene, log, summary.load_ms);
    summary.backend = deviceText(renderer->id());
    summary.tier = renderer->tierOf(options.frame.tier);

    if (options.shard.isGiven())
        summary.backend = renderer->id().backend; // shards of one machine have a device each
    shard.begin(shots, summary.backend, summary.tier);
    summary.set_frames = shots.size();
    summary.shard_frames = shard.own();
    summary.frames_before = shard.own() - shard.frames().size();

    const auto eye_count = uint32_t(options.view.eyes);
    const std::vector<size_t>& frames = shard.frames();
    FrameLoop loop(*scene, shots, eye_count, frameOptions(*scene, options.frame), *renderer,
                   control ? &*control : nullptr);
    const auto prepare = [&](size_t, LoopFrame& frame) {
        stopIfInterrupted(frames.size(), summary, options);
        frame.drawToHost();
    };
    loop.run(
        frames.size(), renderer->framesInFlight(), [&](size_t n) { return frames[n]; }, prepare,
        [&](size_t n, LoopFrame& drawn, const TimedFrame& frame) {
            stopIfInterrupted(frames.size(), summary, options);
            const size_t i = frames[n];
            const Camera& camera = shots[i].camera;
            const FrameStats stats{shots[i].index, camera.name, summary.backend,     summary.tier, camera.width,
                                   camera.height,  eye_count,   shots[i].appearance, frame.result, frame.lod_bias};
            Image images[kMaxEyes];
            for (uint32_t eye = 0; eye < eye_count; ++eye)
                images[eye] = {camera.width, camera.height, std::move(drawn.images[eye])};
            for (uint32_t eye = 0; eye < eye_count && !paths.empty(); ++eye) {
                writeImage(paths[i * eye_count + eye], images[eye], options.output.depth, shard.mayReplace(i));
                summary.images.push_back(paths[i * eye_count + eye]);
            }
            streams.add(std::span(images, eye_count));
            for (uint32_t eye = 0; eye < eye_count; ++eye)
                drawn.images[eye] = std::move(images[eye].pixels); // the same memory for every frame
            if (stats_file)
                stats_file->write(frameStatsJson(stats) + "\n");
            if (options.shard.isGiven())
                shard.add(i, frameStatsJson(stats));
            noteFrame(log, stats);
            summary.frames.push_back(frame);
            log.progress("render", summary.frames.size(), frames.size());
        });
    summary.service = serviceStats(*renderer);
    if (streams.video)
        streams.video->commit();
    if (stats_file)
        stats_file->commit();
    return summary;
}

} // namespace gsc
