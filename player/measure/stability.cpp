// SPDX-License-Identifier: Apache-2.0
#include "player/measure/stability.h"

#include "format/error.h"
#include "player/measure/measurer.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

namespace gsc {

namespace {

namespace fs = std::filesystem;

// Changes of the error image that nobody can see, root mean square: a tenth of the step of an 8-bit display. A path
// whose median is less is judged as if it were this: else one that is exact most of the time would pass no bound.
constexpr double kInvisible = 0.1 / 255;

// The files that the command line names, folders opened.
std::vector<std::string> cameraFiles(const StabilityOptions& options)
{
    if (options.trajectories.empty())
        throw Error(ErrorCode::Usage,
                    formatString("--trajectories: none given, expected camera files or a folder of them; gsc sample "
                                 "paths %s -o DIR makes those that break reuse",
                                 options.play.input.c_str()));
    std::vector<std::string> files;
    for (const std::string& given : options.trajectories) {
        std::error_code code;
        if (!fs::is_directory(given, code)) {
            files.push_back(given);
            continue;
        }
        std::vector<std::string> found;
        for (fs::directory_iterator entry(given, code), end; !code && entry != end; entry.increment(code))
            if (entry->path().extension() == ".json")
                found.push_back(entry->path().string());
        if (found.empty())
            throw Error(ErrorCode::Io, formatString("%s: holds no camera file (%s), expected *.json; gsc sample paths "
                                                    "%s -o DIR makes some",
                                                    given.c_str(), code ? code.message().c_str() : "no *.json",
                                                    options.play.input.c_str()));
        std::sort(found.begin(), found.end());
        files.insert(files.end(), found.begin(), found.end());
    }
    return files;
}

// A range that ends behind the last camera of every trajectory is a mistake.
void checkFrames(const PlayOptions& options, const std::vector<StabilityPath>& paths)
{
    size_t most = 0;
    for (const StabilityPath& entry : paths)
        most = std::max(most, entry.path.shots.size());
    if (options.frame_end != std::numeric_limits<uint64_t>::max() && options.frame_first + most < options.frame_end)
        throw Error(
            ErrorCode::Usage,
            formatString("%s: ends behind the last camera of every trajectory, expected at most %llu; pass that",
                         options.frame_range.c_str(), static_cast<unsigned long long>(options.frame_first + most)));
}

} // namespace

std::vector<Verdict> judge(const StabilityOptions& options, const RunResult& run)
{
    // comparisons are written so that a NaN fails
    std::vector<Verdict> verdicts;
    const Accuracy& accuracy = run.accuracy;
    if (options.bound_psnr > 0)
        verdicts.push_back({"psnr", options.bound_psnr, accuracy.psnr_min, accuracy.psnr_min_frame,
                            accuracy.psnr_min >= options.bound_psnr});
    if (options.bound_temporal > 0 && accuracy.temporal.images > 0) {
        const double ratio = accuracy.temporal.max / std::max(accuracy.temporal.p50, kInvisible);
        verdicts.push_back(
            {"temporal", options.bound_temporal, ratio, accuracy.temporal.max_frame, ratio <= options.bound_temporal});
    }
    if (options.bound_p99 > 0) {
        const TimedFrames timed = timedFrames(run.frames, options.warmup);
        const Spread wall = timesOf(timed).wall;
        const double ratio = wall.median > 0 ? wall.p99 / wall.median : 1;
        const auto worst = std::ranges::max_element(timed, {}, &TimedFrame::wall_ms) - timed.begin();
        verdicts.push_back({"p99", options.bound_p99, ratio, run.frames.size() - timed.size() + uint64_t(worst),
                            ratio <= options.bound_p99});
    }
    return verdicts;
}

StabilitySummary stability(const StabilityOptions& options, Reporter& log)
{
    const std::vector<std::string> files = cameraFiles(options);
    const std::shared_ptr<const Scene> scene = Scene::open(options.play.input, options.play.verify);
    StabilitySummary summary;
    summary.file = {options.play.input, scene->bytes(), scene->anchorCount()};
    PlayOptions reading = options.play;
    uint64_t total = 0, before = 0;
    for (const std::string& file : files) {
        reading.cameras = file;
        summary.paths.push_back({openPath(*scene, reading, file, log), {}, {}});
        total += summary.paths.back().path.shots.size();
    }
    checkFrames(options.play, summary.paths);
    Measurer measurer(scene, reading, options.reference, log);
    summary.backend = measurer.nameOf(reading.backend);
    summary.reference = measurer.referenceOf(summary.backend);
    const FrameOptions frame = frameOptions(*scene, reading);
    for (StabilityPath& entry : summary.paths) {
        log.progressPart(entry.path.name);
        entry.run = measurer.run(entry.path, summary.backend, frame, {},
                                 [&](uint64_t done) { log.progress("render", before + done, total); });
        before += entry.path.shots.size();
        entry.verdicts = judge(options, entry.run);
    }
    summary.warnings = log.warnings();
    return summary;
}

} // namespace gsc
