// SPDX-License-Identifier: Apache-2.0
#include "player/measure/stability.h"

#include <gsc/error.h>
#include "player/measure/measurer.h"
#include "player/measure/new_warnings.h"
#include "player/measure/run_facts.h"
#include "player/measure/run_text.h"
#include "player/shard/shard_rows.h"
#include "runtime/records/row_lines.h"
#include "player/frames/content_hash.h"
#include "player/devices/open_renderer.h"
#include "player/devices/worker_options.h"
#include <gsc/file/output_file.h>
#include <gsc/file/output_paths.h>
#include <gsc/frame_stats.h>
#include "player/frames/lod_target.h"
#include "player/frames/path.h"
#include "runtime/cli/printed_command.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>
#include <map>

namespace gsc {

namespace {

namespace fs = std::filesystem;

// Change of the error image that nobody can see, root mean square: a tenth of the step of an 8-bit display. It is the least
// median that a path is judged by: with a median near 0 any change would exceed the bound.
constexpr double kInvisible = 0.1 / 255;

// Files of --trajectories, with the files of its folders.
std::vector<std::string> cameraFiles(const StabilityOptions& options)
{
    if (options.trajectories.empty())
        throw Error(ErrorCode::Usage, "--trajectories", "none given", "camera files or a folder of them",
                    "gsc sample paths " + shellWord(options.play.model.file) + " -o DIR makes those that break reuse");
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
                        "*.json", "gsc sample paths " + shellWord(options.play.model.file) + " -o DIR makes some");
        std::sort(found.begin(), found.end());
        files.insert(files.end(), found.begin(), found.end());
    }
    return files;
}

// Throws Error(Usage) if --frames ends behind the last camera of every trajectory.
void checkFrames(const CameraChoice& from, const std::vector<Path>& paths)
{
    size_t most = 0;
    for (const Path& path : paths)
        most = std::max(most, path.shots.size());
    if (from.end != std::numeric_limits<uint64_t>::max() && from.first + most < from.end)
        throw Error(ErrorCode::Usage, from.range, "ends behind the last camera of every trajectory",
                    formatString("at most %llu", static_cast<unsigned long long>(from.first + most)), "pass that");
}

// Checks --out of a shard, before any work. Throws Error.
void checkStabilityOutput(const StabilityOptions& options, const std::vector<std::string>& files)
{
    std::vector<NamedPath> inputs = {{options.play.model.file, "the model"}};
    for (const std::string& file : files)
        inputs.push_back({file, "a camera file"});
    const NamedPath out{options.out, "--out"};
    checkOutputsDiffer(std::span(&out, 1), inputs);
    checkAppend(options.out);
}

// Throws Error(Usage) if changes are bounded and no two frames in a row are scored.
void checkChanges(const StabilityOptions& options, const Path& path)
{
    const uint64_t frames = path.shots.size();
    if (options.bound_temporal > 0 && frames > 1 && options.score.scoredOf(frames) < 2)
        throw Error(
            ErrorCode::Usage, formatString("--score-first %llu", static_cast<unsigned long long>(options.score.first)),
            "leaves one frame of " + path.name + ", and --bound-temporal bounds changes from each frame to the next",
            "two frames or more", "pass --bound-temporal 0 too");
}

// Hash of all that changes what the trajectories give: their ids and the bounds.
uint64_t stabilityHash(const StabilityOptions& options, const std::vector<std::string>& ids)
{
    const OrderedJson said = {{"tool", toJson(thisTool())},
                              {"ids", ids},
                              {"bounds", {options.bound_psnr, options.bound_temporal, options.bound_p99}}};
    const std::string text = jsonText(said, -1);
    return checksum64(std::as_bytes(std::span(text)));
}

RunContext contextOf(const StabilityOptions& options, const Scene& scene, const std::string& reference)
{
    RunContext context;
    context.view = options.play.view;
    context.devices = options.play.devices;
    context.appearance = options.play.cameras.appearance;
    context.reference = reference;
    context.file = {options.play.model.file, scene.bytes(), scene.anchorCount()};
    context.file_hash = fileHash(options.play.model.file);
    context.warmup = options.warmup;
    context.score = options.score;
    return context;
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
        rows.emplace(options.out, kRunRow, shard, "stability");
    }
    const std::shared_ptr<const Scene> scene = openScene(options.play.model, options.play.devices, log);
    const PlayOptions& play = options.play;
    checkLevelOptions(*scene, play.model.file, play.frame);
    std::vector<Path> paths;
    std::vector<uint64_t> lengths;
    // A row has only the warnings of its trajectory, so that every shard would write equal bytes.
    std::vector<std::vector<std::string>> warnings;
    NewWarnings new_warnings(log);
    for (const std::string& file : files) {
        paths.push_back(openPath(*scene, play.model.file, play.cameras.of(file), play.view, file, log));
        lengths.push_back(paths.back().shots.size());
        checkScored(options.score, paths.back(), "--score-first");
        checkChanges(options, paths.back());
        new_warnings.addTo(warnings.emplace_back());
    }
    checkFrames(play.cameras, paths);
    Measurer measurer(scene, play.model, play.devices, options.reference, options.score, log);
    StabilitySummary summary;
    summary.backend = measurer.nameOf(play.devices.backend);
    summary.reference = measurer.referenceOf(summary.backend);
    summary.all_paths = paths.size();
    const RunContext context = contextOf(options, *scene, summary.reference);
    const auto runOn = [&](const Path& path) {
        RunConfig run{play.frame, summary.backend, false};
        run.on_path = path.no_path.empty();
        return run;
    };
    std::vector<RowConfig> configs;
    std::vector<std::string> ids;
    for (const Path& path : paths) {
        configs.push_back(rowConfig(context, path, runOn(path)));
        ids.push_back(configs.back().id);
    }
    if (rows) {
        rows->check(shardFacts(shard, paths.size(), context.file_hash, stabilityHash(options, ids)));
        rows->begin();
        if (!rows->cutOff().empty())
            log.tell(rows->cutOff()); // not a warning in a row: pictures do not depend on it
    }

    const std::vector<uint64_t> shards = blockShards(lengths, std::max<uint64_t>(1, shard.count));
    std::vector<size_t> own;
    std::vector<Measurer::Planned> planned; // those of `own` without a row
    for (size_t i = 0; i < paths.size(); ++i)
        if (!shard.isGiven() || shards[i] + 1 == shard.index) {
            own.push_back(i);
            if (!rows || !rows->find(i))
                planned.push_back({&paths[i], summary.backend});
        }
    std::span<const Measurer::Planned> to_come = planned;
    std::map<std::string, std::vector<std::string>>
        without_path; // warnings of detail, given once for all trajectories with one reason
    for (const size_t i : own) {
        const auto [found, is_new] = without_path.try_emplace(paths[i].no_path);
        if (is_new)
            (void)choiceOn(paths[i].no_path, play.frame, log); // also for trajectories that are done
        new_warnings.addTo(found->second);
        warnings[i].insert(warnings[i].end(), found->second.begin(), found->second.end());
    }
    for (const size_t i : own) {
        if (const OrderedJson* const known = rows ? rows->find(i) : nullptr) {
            summary.rows.push_back(runRowOf(*known, options.out));
            ++summary.rows_before;
        } else {
            log.progressPart(paths[i].name);
            const RunResult result = measurer.run(to_come, frameOptions(*scene, runOn(paths[i])));
            to_come = to_come.subspan(1);
            RunRow& row = summary.rows.emplace_back(runRow(context, configs[i], summary.backend, result));
            row.stability = StabilityFacts{judge(options, result)};
            new_warnings.addTo(warnings[i]);
            row.warnings = warnings[i];
            if (rows) {
                rows->add(i, jsonText(toJson(row), -1));
                row.shard = rows->factsOf(i);
            }
        }
    }
    return summary;
}

std::string stabilityText(const StabilityOptions& options, const StabilitySummary& summary)
{
    std::string text = formatString(
        "%s: %s, %s against exact of %s\n", options.play.model.file.c_str(), summary.backend.c_str(),
        summary.rows.empty() ? tierName(options.play.frame.tier) : summary.rows.back().rendered_tier.c_str(),
        summary.reference.c_str());
    if (options.play.shard.isGiven())
        text += formatString("shard %s: %zu of %s, %s of them done before\n", options.play.shard.text().c_str(),
                             summary.rows.size(), formatCount(summary.all_paths, "trajectory", "trajectories").c_str(),
                             formatCount(summary.rows_before).c_str());
    text += stabilityTableHeader();
    for (const RunRow& row : summary.rows)
        text += stabilityTableLine(row);
    return text + stabilityTableNotes();
}

} // namespace gsc
