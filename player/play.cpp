// SPDX-License-Identifier: Apache-2.0
#include "player/play.h"

#include "format/error.h"
#include "format/interrupt.h"
#include "format/file/output_file.h"
#include "format/file/output_paths.h"
#include "player/lod_target.h"
#include "player/measure/runner.h"
#include "player/measure/stopwatch.h"
#include "player/open_renderer.h"
#include "player/out_pattern.h"
#include "player/shots.h"
#include "runtime/scene.h"

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <memory>

namespace gsc {

namespace {

// Paths of the images, checked before anything is rendered; their folders exist afterwards.
std::vector<std::string> prepareOutputs(const std::vector<Shot>& shots, const PlayOptions& options, bool json_summary)
{
    namespace fs = std::filesystem;
    std::vector<std::string> paths;
    if (!options.out.empty()) {
        std::vector<OutputFrame> named;
        for (const Shot& shot : shots)
            named.push_back({shot.camera.name, shot.index});
        paths = outputPaths(options.out, named, options.eyes);
    }
    std::vector<NamedPath> outputs, inputs = {{options.input, "the model"}};
    for (const std::string& path : paths)
        outputs.push_back({path, "an image of --out"});
    if (!options.stats.empty())
        outputs.push_back({options.stats, "--stats"});
    if (options.cameras != "stored")
        inputs.push_back({options.cameras, "the camera file"});
    checkStandardOutput(options.stats, "--stats", json_summary);
    checkOutputsDiffer(outputs, inputs);
    for (const std::string& path : paths)
        checkOutput(path, OutputKind::Binary, options.overwrite, OutputFolder::IsMade);
    if (!options.stats.empty())
        checkOutput(options.stats, OutputKind::Text, options.overwrite, OutputFolder::IsMade);
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

// Images are kept, each is whole.
void stopIfInterrupted(size_t frames, const PlaySummary& summary)
{
    if (interrupted())
        throw Error(ErrorCode::Interrupted,
                    formatString("interrupted: stopped after %zu of %zu frames, expected to run to the end; run it "
                                 "again (%zu image%s written, all complete, and no statistics file)",
                                 summary.frames.size(), frames, summary.images.size(),
                                 summary.images.size() == 1 ? " was" : "s were"));
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
    const auto open_start = std::chrono::steady_clock::now();
    const std::shared_ptr<const Scene> scene = Scene::open(options.input, options.verify);
    summary.open_ms = millisecondsSince(open_start);
    summary.file = {options.input, scene->bytes(), scene->anchorCount()};

    const std::vector<Shot> shots = chooseShots(*scene, options, log);
    std::optional<LodControl> control = lodControl(*scene, options);
    const std::vector<std::string> paths = prepareOutputs(shots, options, log.json());
    std::optional<OutputFile> stats_file;
    if (!options.stats.empty())
        stats_file.emplace(options.stats, OutputKind::Text, options.overwrite);

    const std::unique_ptr<Renderer> renderer = openRenderer(options, scene, log, summary.load_ms);
    summary.backend = deviceText(renderer->id());
    summary.tier = renderer->tierOf(options.tier);

    FrameOptions frame_options = frameOptions(*scene, options);
    std::vector<float> pixels[kMaxEyes];
    const auto eye_count = uint32_t(options.eyes);
    for (size_t i = 0; i < shots.size(); ++i) {
        stopIfInterrupted(shots.size(), summary);
        const Camera& camera = shots[i].camera;
        if (control)
            frame_options.lod_bias = float(control->bias());
        const TimedFrame frame = renderShot(*scene, shots[i], eye_count, frame_options, *renderer, pixels);
        const FrameStats stats{shots[i].index, camera.name, summary.backend,     summary.tier, camera.width,
                               camera.height,  eye_count,   shots[i].appearance, frame.result, frame.lod_bias};
        stopIfInterrupted(shots.size(), summary);

        for (uint32_t eye = 0; eye < eye_count && !paths.empty(); ++eye) {
            Image image{camera.width, camera.height, std::move(pixels[eye])};
            writeImage(paths[i * eye_count + eye], image, options.depth, options.overwrite);
            pixels[eye] = std::move(image.pixels); // the same memory for every frame
            summary.images.push_back(paths[i * eye_count + eye]);
        }
        if (stats_file)
            stats_file->write(frameStatsJson(stats) + "\n");
        noteFrame(log, stats);
        summary.frames.push_back(frame);
        if (control)
            control->add(frame.result.times.total);
        log.progress("render", i + 1, shots.size());
    }
    if (stats_file)
        stats_file->commit();
    return summary;
}

} // namespace gsc
