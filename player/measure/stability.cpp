// SPDX-License-Identifier: Apache-2.0
#include "player/measure/stability.h"

#include <gsc/error.h>
#include "player/measure/measurer.h"
#include "player/shard/shard_rows.h"
#include "player/frames/content_hash.h"
#include "player/devices/open_renderer.h"
#include "player/devices/worker_options.h"
#include <gsc/file/output_file.h>
#include <gsc/file/output_paths.h>
#include <gsc/frame_stats.h>
#include "player/frames/lod_target.h"
#include "player/frames/path.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>
#include <set>

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
        throw Error(ErrorCode::Usage, "--trajectories", "none given", "camera files or a folder of them",
                    "gsc sample paths " + options.play.model.file + " -o DIR makes those that break reuse");
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
            throw Error(ErrorCode::Io, given,
                        formatString("holds no camera file (%s)", code ? code.message().c_str() : "no *.json"),
                        "*.json", "gsc sample paths " + options.play.model.file + " -o DIR makes some");
        std::sort(found.begin(), found.end());
        files.insert(files.end(), found.begin(), found.end());
    }
    return files;
}

// A range that ends behind the last camera of every trajectory is a mistake.
void checkFrames(const CameraChoice& from, const std::vector<Path>& paths)
{
    size_t most = 0;
    for (const Path& path : paths)
        most = std::max(most, path.shots.size());
    if (from.end != std::numeric_limits<uint64_t>::max() && from.first + most < from.end)
        throw Error(ErrorCode::Usage, from.range, "ends behind the last camera of every trajectory",
                    formatString("at most %llu", static_cast<unsigned long long>(from.first + most)), "pass that");
}

// --out of a shard, before any work.
void checkStabilityOutput(const StabilityOptions& options, const std::vector<std::string>& files)
{
    std::vector<NamedPath> inputs = {{options.play.model.file, "the model"}};
    for (const std::string& file : files)
        inputs.push_back({file, "a camera file"});
    const NamedPath out{options.out, "--out"};
    checkOutputsDiffer(std::span(&out, 1), inputs);
    checkAppend(options.out);
}

// A bound on changes needs two frames in a row.
void checkChanges(const StabilityOptions& options, const Path& path)
{
    const uint64_t frames = path.shots.size();
    if (options.bound_temporal > 0 && frames > 1 && options.score.scoredOf(frames) < 2)
        throw Error(
            ErrorCode::Usage, formatString("--score-first %llu", static_cast<unsigned long long>(options.score.first)),
            "leaves one frame of " + path.name + ", and --bound-temporal bounds changes from each frame to the next",
            "two frames or more", "pass --bound-temporal 0 too");
}

// All that changes the report besides times and memory.
uint64_t stabilityHash(const StabilityOptions& options, const StabilitySummary& summary, const std::vector<Path>& paths)
{
    StabilitySummary head = summary;
    head.paths.clear();
    head.file = {};
    OrderedJson names = OrderedJson::array();
    for (const Path& path : paths)
        names.push_back({path.name, path.shots.size()});
    OrderedJson workers = OrderedJson::array(); // each keeps entries of its own
    for (const DeviceId& device : workerDevices(options.play.devices))
        workers.push_back(device.backend);
    const PlayOptions& play = options.play;
    OrderedJson said = {{"report", stabilityReportJson(options, head, false)},
                        {"trajectories", std::move(names)},
                        {"tier", tierName(play.frame.tier)},
                        {"near", play.frame.near_z},
                        {"background", play.frame.background ? OrderedJson(*play.frame.background) : OrderedJson()},
                        {"mode", serviceModeName(play.devices.workers.mode)},
                        {"workers", std::move(workers)},
                        {"vram_budget", play.devices.vram_budget}};
    if (options.score.every > 1 || options.score.first > 0) // shards that score all go on with what they have
        said["scored"] = {options.score.first, options.score.every};
    const std::string text = jsonText(said, -1);
    Checksum64 sum;
    sum.update(std::as_bytes(std::span(text)));
    for (const Path& path : paths)
        addPoses(path.shots, path.eye_count, sum);
    return sum.digest();
}

StabilityPath judged(const StabilityOptions& options, const Path& path, const RunResult& run)
{
    const double ipd = path.eye_count == 2 ? path.shots.front().ipd : 0;
    return {path.name,
            path.cameras,
            path.shots.size(),
            ipd,
            timesOf(timedFrames(run.frames, options.warmup)),
            run.accuracy,
            reuseCounts(run.frames),
            judge(options, run),
            run.tier,
            run.device};
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
    const Shard& shard = options.play.shard;
    std::optional<ShardRows> rows;
    if (shard.isGiven()) {
        checkStabilityOutput(options, files);
        rows.emplace(options.out, kStabilityRow, shard);
    }
    const std::shared_ptr<const Scene> scene = openScene(options.play.model, options.play.devices);
    StabilitySummary summary;
    summary.file = {options.play.model.file, scene->bytes(), scene->anchorCount()};
    const PlayOptions& play = options.play;
    checkLevelOptions(*scene, play.model.file, play.frame);
    std::vector<Path> paths;
    std::vector<uint64_t> lengths;
    for (const std::string& file : files) {
        paths.push_back(openPath(*scene, play.model.file, play.cameras.of(file), play.view, file, log));
        lengths.push_back(paths.back().shots.size());
        checkScored(options.score, paths.back(), "--score-first");
        checkChanges(options, paths.back());
    }
    checkFrames(play.cameras, paths);
    Measurer measurer(scene, play.model, play.devices, options.reference, options.score, log);
    summary.backend = measurer.nameOf(play.devices.backend);
    summary.reference = measurer.referenceOf(summary.backend);
    summary.all_paths = paths.size();
    if (rows) {
        rows->check(
            shardFacts(shard, paths.size(), fileHash(options.play.model.file), stabilityHash(options, summary, paths)));
        rows->begin();
        if (!rows->cutOff().empty())
            log.tell(rows->cutOff()); // no warning of the report: it says nothing of the pictures
    }

    const std::vector<uint64_t> shards = blockShards(lengths, std::max<uint64_t>(1, shard.count));
    std::vector<size_t> own;
    uint64_t total = 0, before = 0;
    for (size_t i = 0; i < paths.size(); ++i)
        if (!shard.isGiven() || shards[i] + 1 == shard.index) {
            own.push_back(i);
            total += lengths[i];
        }
    std::set<std::string> told; // a trajectory may be listed twice
    for (const size_t i : own)
        if (told.insert(paths[i].no_path).second)
            (void)choiceOn(paths[i].no_path, play.frame,
                           log); // also of those that are done: the report is of them, too
    for (const size_t i : own) {
        const OrderedJson* const row = rows ? rows->find(i) : nullptr;
        if (row != nullptr) {
            summary.paths.push_back(readStabilityRow(*row, options.out));
            ++summary.paths_before;
        } else {
            log.progressPart(paths[i].name);
            FrameChoice choice = play.frame;
            choice.on_path = paths[i].no_path.empty();
            const RunResult run = measurer.run(paths[i], summary.backend, frameOptions(*scene, choice),
                                               [&](uint64_t done) { log.progress("render", before + done, total); });
            summary.paths.push_back(judged(options, paths[i], run));
            summary.warnings = log.warnings();
            if (rows)
                rows->add(i, stabilityRow(options, summary, summary.paths.back()));
        }
        before += lengths[i];
    }
    summary.warnings = log.warnings();
    return summary;
}

} // namespace gsc
