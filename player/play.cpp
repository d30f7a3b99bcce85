// SPDX-License-Identifier: Apache-2.0
#include "player/play.h"

#include "format/error.h"
#include "format/interrupt.h"
#include "format/output_paths.h"
#include "player/camera_file.h"
#include "player/json_fields.h"
#include "player/out_pattern.h"
#include "player/stats_file.h"
#include "runtime/backend.h"
#include "runtime/scene.h"

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <memory>

namespace gsc {

namespace {

using Clock = std::chrono::steady_clock;

double millisecondsSince(Clock::time_point start)
{
    return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

struct PlayFrame {
    Camera camera;
    uint64_t index = 0; // in the camera file
};

std::vector<Camera> storedCameras(const Scene& scene, const std::string& file)
{
    std::vector<Camera> cameras;
    for (const SceneCamera& stored : scene.cameras()) {
        UpstreamCamera source;
        source.name = stored.name;
        source.width = stored.width;
        source.height = stored.height;
        std::copy_n(stored.position, 3, source.position);
        std::copy_n(stored.rotation, 9, source.rotation);
        source.fx = stored.fx;
        source.fy = stored.fy;
        cameras.push_back(cameraFromUpstream(source));
        cameras.back().appearance = stored.appearance;
    }
    if (cameras.empty())
        throw Error(ErrorCode::Usage,
                    formatString("%s: holds no cameras, expected some to play; pass --cameras FILE", file.c_str()));
    return cameras;
}

std::vector<PlayFrame> chooseFrames(std::vector<Camera> cameras, const PlayOptions& options)
{
    if (options.frame_first >= cameras.size())
        throw Error(ErrorCode::Usage,
                    formatString("--frames: frame %llu is not there, expected at most %zu",
                                 static_cast<unsigned long long>(options.frame_first), cameras.size() - 1));
    std::vector<PlayFrame> frames;
    const uint64_t end = std::min<uint64_t>(options.frame_end, cameras.size());
    for (uint64_t i = options.frame_first; i < end; ++i) {
        Camera& camera = cameras[i];
        finishCamera(camera, options.width, options.height, options.fov_x);
        if (camera.width < 1 || camera.height < 1 || camera.width > kMaxImageSide || camera.height > kMaxImageSide)
            throw Error(ErrorCode::Usage,
                        formatString("camera %s: its image is %u x %u pixels, expected 1 to %u each; pass --size WxH",
                                     camera.name.c_str(), camera.width, camera.height, kMaxImageSide));
        frames.push_back({std::move(camera), i});
    }
    return frames;
}

// Paths of the images, checked before anything is rendered; their folders exist afterwards.
std::vector<std::string> prepareOutputs(const std::vector<PlayFrame>& frames, const PlayOptions& options)
{
    namespace fs = std::filesystem;
    std::vector<std::string> paths;
    if (!options.out.empty()) {
        std::vector<OutputFrame> named;
        for (const PlayFrame& frame : frames)
            named.push_back({frame.camera.name, frame.index});
        paths = outputPaths(OutPattern(options.out), named, options.eyes);
    }
    std::vector<std::string> files = paths;
    if (!options.stats.empty())
        files.push_back(options.stats);
    std::vector<NamedPath> outputs, inputs = {{options.input, "the model"}};
    for (const std::string& path : paths)
        outputs.push_back({path, "an image of --out"});
    if (!options.stats.empty())
        outputs.push_back({options.stats, "--stats"});
    if (options.cameras != "stored")
        inputs.push_back({options.cameras, "the camera file"});
    checkOutputsDiffer(outputs, inputs);
    for (const std::string& file : files) {
        std::error_code code;
        checkRegularOrAbsent(file);
        if (!options.overwrite && fs::exists(file, code))
            throw Error(ErrorCode::Io, file + ": exists already, expected a new file; pass -w to replace it");
    }
    for (const std::string& file : files) {
        const fs::path folder = fs::path(file).parent_path();
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

// Embedding rows of the frames, source numbering; -1 throughout if the model has none.
std::vector<int> chooseAppearance(const Scene& scene, const std::vector<PlayFrame>& frames, const PlayOptions& options,
                                  PlayLog& log)
{
    std::vector<int> rows(frames.size(), -1);
    if (options.appearance >= 0) {
        (void)scene.appearanceRow(options.appearance); // throws where the model has no such row
        std::fill(rows.begin(), rows.end(), options.appearance);
        return rows;
    }
    const std::vector<uint32_t> known = scene.appearanceRows();
    if (known.empty())
        return rows;
    const int fallback = int(known.front());
    uint64_t without = 0, missing = 0;
    for (size_t i = 0; i < frames.size(); ++i) {
        const int wanted = frames[i].camera.appearance;
        const bool there = wanted >= 0 && std::binary_search(known.begin(), known.end(), uint32_t(wanted));
        without += wanted < 0;
        missing += wanted >= 0 && !there;
        rows[i] = there ? wanted : fallback;
    }
    if (without > 0)
        log.warning(formatString("%s: the model has an appearance embedding and %llu of %zu cameras name no row of it; "
                                 "row %d is used, pass --appearance ROW to choose",
                                 options.input.c_str(), static_cast<unsigned long long>(without), frames.size(),
                                 fallback));
    if (missing > 0)
        log.warning(formatString("%s: %llu of %zu cameras name an appearance row that is not in the file; row %d is "
                                 "used, pass --appearance ROW to choose",
                                 options.input.c_str(), static_cast<unsigned long long>(missing), frames.size(),
                                 fallback));
    return rows;
}

FrameOptions frameOptions(const Scene& scene, const PlayOptions& options)
{
    FrameOptions frame;
    frame.tier = options.tier;
    frame.near_z = float(options.near_z);
    const bool white = (scene.view().params->flags & kModelWhiteBackground) != 0;
    for (size_t c = 0; c < 3; ++c)
        frame.background[c] = options.background ? (*options.background)[c] : white ? 1.0f : 0.0f;
    return frame;
}

// Images are kept, each is whole.
void stopIfInterrupted(size_t frames, const PlaySummary& summary)
{
    if (interrupted())
        throw Error(ErrorCode::Interrupted,
                    formatString("interrupted: stopped after %zu of %zu frames; %zu image%s written, all complete, and "
                                 "no statistics file",
                                 summary.frames.size(), frames, summary.images.size(),
                                 summary.images.size() == 1 ? " was" : "s were"));
}

void noteFrame(PlayLog& log, const FrameStats& stats)
{
    const StageTimes& t = stats.result.times;
    log.note(formatString("frame %llu %s: %.1f ms (select %.1f, decode %.1f, project %.1f, bin %.1f, sort %.1f, blend "
                          "%.1f), %llu anchors, %llu pairs",
                          static_cast<unsigned long long>(stats.frame), stats.camera.c_str(), t.total, t.select,
                          t.decode, t.project, t.bin, t.sort, t.blend,
                          static_cast<unsigned long long>(stats.result.eyes[0].anchors_visible),
                          static_cast<unsigned long long>(stats.result.eyes[0].pairs)));
}

} // namespace

PlaySummary play(const PlayOptions& options, PlayLog& log)
{
    PlaySummary summary;
    summary.input = options.input;
    summary.eyes = options.eyes;

    const Clock::time_point open_start = Clock::now();
    const std::unique_ptr<Scene> scene = Scene::open(options.input, options.verify);
    summary.open_ms = millisecondsSince(open_start);
    summary.anchors = scene->anchorCount();
    summary.file_bytes = scene->bytes();

    double ipd = 0;
    const std::vector<PlayFrame> frames = chooseFrames(
        options.cameras == "stored" ? storedCameras(*scene, options.input) : readCameraFile(options.cameras, &ipd),
        options);
    if (options.ipd > 0)
        ipd = options.ipd;
    if (options.eyes == 2 && ipd == 0)
        throw Error(
            ErrorCode::Usage,
            formatString("%s: states no distance of the eyes, expected \"ipd\" in a trajectory; pass --ipd LENGTH",
                         options.cameras.c_str()));
    const std::vector<int> rows = chooseAppearance(*scene, frames, options, log);
    const std::vector<std::string> paths = prepareOutputs(frames, options);
    StatsFile stats_file(options.stats);

    const std::unique_ptr<Backend> backend = makeBackend(options.backend, options.threads);
    summary.backend = backend->name();
    summary.tier = backend->tierOf(options.tier);
    const Clock::time_point load_start = Clock::now();
    backend->load(scene->view());
    summary.load_ms = millisecondsSince(load_start);

    FrameOptions frame_options = frameOptions(*scene, options);
    Image images[kMaxEyes];
    const auto eye_count = uint32_t(options.eyes);
    for (size_t i = 0; i < frames.size(); ++i) {
        stopIfInterrupted(frames.size(), summary);
        const Camera& camera = frames[i].camera;
        Camera eye_cameras[kMaxEyes] = {camera, camera};
        if (eye_count == 2)
            stereoPair(camera, ipd, eye_cameras[0], eye_cameras[1]);
        EyeParams eyes[kMaxEyes];
        float* pixels[kMaxEyes] = {};
        for (uint32_t eye = 0; eye < eye_count; ++eye) {
            eyes[eye] = eyeParams(eye_cameras[eye]);
            images[eye].width = camera.width;
            images[eye].height = camera.height;
            images[eye].pixels.resize(size_t(camera.width) * camera.height * 3);
            pixels[eye] = images[eye].pixels.data();
        }
        frame_options.appearance = rows[i] < 0 ? -1 : scene->appearanceRow(rows[i]);

        FrameStats stats{frames[i].index, camera.name,  backend->name(),
                         summary.tier,    camera.width, camera.height,
                         eye_count,       rows[i],      {}};
        backend->render(eyes, eye_count, frame_options, pixels, stats.result);
        stopIfInterrupted(frames.size(), summary);

        for (uint32_t eye = 0; eye < eye_count && !paths.empty(); ++eye) {
            writeImage(paths[i * eye_count + eye], images[eye], options.depth);
            summary.images.push_back(paths[i * eye_count + eye]);
        }
        stats_file.add(stats);
        noteFrame(log, stats);
        summary.frames.push_back(stats.result);
        summary.pixels.push_back(double(camera.width) * camera.height);
        log.progress(i + 1, frames.size());
    }
    stats_file.finish();
    return summary;
}

} // namespace gsc
