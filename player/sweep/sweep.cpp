// SPDX-License-Identifier: Apache-2.0
#include "player/sweep/sweep.h"

#include <gsc/error.h>
#include "runtime/cli/setting_words.h"
#include <gsc/file/output_file.h>
#include <gsc/file/read_file.h>
#include "player/frames/content_hash.h"
#include "player/frames/lod_target.h"
#include "player/measure/measurer.h"
#include "player/measure/new_warnings.h"
#include "player/shard/shard_rows.h"
#include "runtime/backend/frame_checks.h"
#include "runtime/records/row_file.h"
#include "player/measure/run_facts.h"
#include "player/sweep/run_rows.h"
#include "player/sweep/sweep_config.h"
#include "player/devices/open_renderer.h"
#include "player/measure/row_output.h"
#include "player/frames/path.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <numbers>
#include <numeric>
#include <optional>
#include <set>
#include <span>

namespace gsc {

namespace {

constexpr size_t kMaxConfigBytes = 16 << 20;

ViewChoice viewOf(const SweepConfig& config, ViewChoice view)
{
    if (config.width > 0) {
        view.width = config.width;
        view.height = config.height;
    }
    if (config.fov_degrees > 0)
        view.fov_x = config.fov_degrees * std::numbers::pi / 180;
    if (config.eyes > 0)
        view.eyes = config.eyes;
    return view;
}

std::string resolved(const std::string& config_file, const std::string& trajectory)
{
    return trajectory == "stored" ? trajectory
                                  : (std::filesystem::path(config_file).parent_path() / trajectory).string();
}

void checkOut(const BenchOptions& options, const SweepConfig& config, bool json_summary)
{
    std::vector<NamedPath> inputs = {{options.play.model.file, "the model"}, {options.sweep, "the file of --sweep"}};
    for (const std::string& trajectory : config.trajectories)
        if (trajectory != "stored")
            inputs.push_back({resolved(options.sweep, trajectory), "a camera file"});
    checkRowOutput(options.out, inputs, json_summary);
}

// Mean of the anchors that a run decoded per frame and eye, rounded, at least one.
uint64_t meanDecodes(const RunRow& row)
{
    // without the first frame, in which every policy decodes everything, even with a budget
    const size_t first = row.decoded.size() > 1 ? 1 : 0;
    const double sum = std::accumulate(row.decoded.begin() + ptrdiff_t(first), row.decoded.end(), 0.0);
    const double mean = sum / double(row.decoded.size() - first) / row.config.eyes;
    return uint64_t(std::clamp(std::round(mean), 1.0, 1e15));
}

// The run on a path; without detail if the cameras are no path.
RunConfig runOnPath(RunConfig run, const Path& path)
{
    run.on_path = path.no_path.empty();
    run.detail = run.detailPixels();
    return run;
}

// All runs of a sweep, or those of a shard.
class Sweep {
public:
    Sweep(const BenchOptions& options, const SweepConfig& config, Reporter& log)
        : m_config(config), m_log(log), m_rows(options.out, options.play.shard.isGiven()),
          m_scene(openScene(options.play.model, options.play.devices, log)), m_new_warnings(log)
    {
        const PlayOptions& play = options.play;
        checkLevelOptions(*m_scene, play.model.file, play.frame);
        m_context.view = viewOf(config, play.view);
        m_context.devices = play.devices;
        m_context.appearance = play.cameras.appearance;
        for (const std::string& trajectory : config.trajectories) {
            CameraChoice from = play.cameras.of(resolved(options.sweep, trajectory));
            if (config.frames > 0)
                from.end = config.frames;
            m_paths.push_back(openPath(*m_scene, play.model.file, from, m_context.view, trajectory, log));
            m_new_warnings.addTo(m_path_warnings.emplace_back());
            checkScored(config.score, m_paths.back(), options.sweep + ": score_first");
        }
        m_context.label = options.label;
        m_context.file = {options.play.model.file, m_scene->bytes(), m_scene->anchorCount()};
        m_context.file_hash = fileHash(options.play.model.file);
        m_context.warmup = config.warmup;
        m_context.score = config.score;
        m_measurer =
            std::make_unique<Measurer>(m_scene, play.model, play.devices, options.reference, config.score, log);
        if (!m_rows.cutOff().empty())
            log.warning(m_rows.cutOff());
        m_runs = expandRuns(config);
        for (const RunConfig& run : m_runs)
            if (run.stereo == StereoMode::Merged && m_context.view.eyes == 1)
                throw Error(ErrorCode::Usage, options.sweep, "a run has stereo merged and there is one eye", "two eyes",
                            "state \"eyes\": 2 or pass --eyes 2");
        for (const RunConfig& run : m_runs)
            for (const auto& [axis, value] : {std::pair<const char*, double>{"lod_bias", run.lod_bias},
                                              {"lod_fade", run.lod_fade},
                                              {"lod_hysteresis", run.lod_hysteresis}})
                checkLevelChoice(*m_scene, options.play.model.file, options.sweep + ": a run has " + axis, value);
        std::set<std::string> backends;
        for (const RunConfig& run : m_runs)
            if (backends.insert(run.backend).second)
                checkUsable({run.backend, 0}); // now, because renderers are opened only when they are needed
        for (RunConfig& run : m_runs)
            run.backend = m_measurer->nameOf(run.backend);
        plan(options);
        warnOfDetail();
    }

    void runAll(const std::function<void(const RunRow&)>& show)
    {
        for (Task& task : m_tasks)
            if ((task.is_planned = !hasRow(task)))
                m_planned.push_back({task.path, task.run->backend});
        for (const Task& task : m_tasks) {
            const Path& path = *task.path;
            m_log.progressPart(formatString("run %zu/%zu %s", m_runs_done + 1, m_tasks.size(), path.name.c_str()));
            try {
                show(rowOf(task));
            } catch (const Error& e) {
                if (e.code() != ErrorCode::Unsupported)
                    throw;
                m_log.warning(formatString("left out: %s", warningText(e).c_str()));
            }
            ++m_runs_done;
            m_planned_done += task.is_planned;
        }
        if (m_shard)
            m_log.tell(formatString("shard %s: %s of %s", m_given_shard.c_str(), formatCount(m_tasks.size()).c_str(),
                                    formatCount(m_shard->tasks, "run").c_str()));
        if (m_found > 0)
            m_log.tell(formatString("in the file already: %s of %s", formatCount(m_found).c_str(),
                                    formatCount(m_runs_done, "run").c_str()));
    }

    // Throws Error(Interrupted) with the number of runs that are done.
    [[noreturn]] void throwInterrupted(const std::string& out) const
    {
        const bool is_kept = !out.empty() && !isStandardOutput(out);
        throw Error(ErrorCode::Interrupted, "interrupted",
                    formatString("%s of %s are done%s", formatCount(m_runs_done).c_str(),
                                 formatCount(m_tasks.size(), "run").c_str(),
                                 is_kept ? (" and in " + out + ", all complete").c_str() : ""),
                    "to run to the end", is_kept ? "the same command goes on there" : "run it again");
    }

private:
    struct Task {
        const Path* path;
        const RunConfig* run;
        uint64_t number;         // counted over all shards, first 0
        bool is_planned = false; // to be measured
    };

    // Sets the tasks, each once: trajectories may be listed twice, and two names of --backend may be one backend.
    void plan(const BenchOptions& options)
    {
        const Shard& shard = options.play.shard;
        std::vector<std::string> ids;
        std::set<std::string> known_ids;
        std::vector<Task> tasks;
        std::vector<uint64_t> frames;
        for (const Path& path : m_paths)
            for (const RunConfig& run : m_runs) {
                m_context.reference = m_measurer->referenceOf(run.backend);
                const std::string id = rowConfig(m_context, path, runOnPath(run, path)).id;
                const bool is_new = known_ids.insert(id).second;
                tasks.push_back({&path, &run, ids.size()});
                frames.push_back(is_new ? path.shots.size() : 0);
                if (is_new)
                    ids.push_back(id);
            }
        const std::vector<uint64_t> shards = sweepShards(m_config, m_runs, frames, std::max<uint64_t>(1, shard.count));
        for (size_t i = 0; i < tasks.size(); ++i)
            if (frames[i] > 0 && (!shard.isGiven() || shards[i] + 1 == shard.index))
                m_tasks.push_back(tasks[i]);
        if (!shard.isGiven())
            return;
        m_given_shard = shard.text();
        m_shard = shardFacts(shard, ids.size(), m_context.file_hash, sweepHash(m_context, ids));
        if (std::error_code code; !std::filesystem::exists(options.out, code)) // a shard without a task has a file too
            writeTextFile(options.out, "", false);
        for (const auto& [id, row] : m_rows.all()) {
            if (!row.shard)
                throw Error(ErrorCode::Usage, options.out, "has rows of a sweep that was not split",
                            "those of shard " + m_given_shard, "give every shard its own --out");
            checkShardRow(*row.shard, *m_shard, options.out, "--out");
        }
    }

    // Warns about detail, once for each path that this shard draws.
    void warnOfDetail()
    {
        std::set<const Path*> told;
        for (const Task& task : m_tasks)
            if (told.insert(task.path).second) {
                (void)choiceOn(task.path->no_path, *std::ranges::max_element(m_runs, {}, &RunConfig::detailPixels),
                               m_log);
                m_new_warnings.addTo(warningsOf(*task.path));
            }
    }

    // The run of a task, and the reference for its row; none if the run that its budget is taken from has no row.
    std::optional<RunConfig> settledRun(const Task& task)
    {
        RunConfig run = runOnPath(*task.run, *task.path);
        m_context.reference = m_measurer->referenceOf(run.backend);
        if (!run.match_budget)
            return run;
        const RunConfig depth = depthRunOf(m_config, run);
        const RunRow* row = known(rowConfig(m_context, *task.path, depth), depth.backend);
        if (!row)
            return std::nullopt;
        run.reuse.decode_budget = meanDecodes(*row);
        run.match_budget = false;
        return run;
    }

    bool hasRow(const Task& task)
    {
        const std::optional<RunConfig> run = settledRun(task);
        return run && known(rowConfig(m_context, *task.path, *run), run->backend);
    }

    RunRow rowOf(const Task& task)
    {
        const Path& path = *task.path;
        checkReuse(task.run->backend, task.run->reuse.policy);
        const std::optional<RunConfig> settled = settledRun(task);
        if (!settled) // expandRuns() puts the run first, so the backend could not draw it
            throw Error(ErrorCode::Unsupported, "sweep",
                        "the run that a decode budget of \"match\" is taken from was left out", "it to be drawn",
                        "state a number, or a backend and tier that draw with policy depth");
        const RunConfig& run = *settled;
        const RowConfig config = rowConfig(m_context, path, run);
        if (const RunRow* row = known(config, run.backend)) {
            ++m_found;
            return m_shard && !m_rows.hasTask(task.number) ? appended(*row, task) : *row;
        }
        const FrameOptions frame = frameOptions(*m_scene, run);
        const RunResult result = m_measurer->run(std::span(m_planned).subspan(m_planned_done), frame);
        RunRow row = runRow(m_context, config, run.backend, result);
        row.warnings = warningsOf(path);
        m_new_warnings.addTo(row.warnings);
        return appended(std::move(row), task);
    }

    std::vector<std::string>& warningsOf(const Path& path) { return m_path_warnings[size_t(&path - m_paths.data())]; }

    RunRow appended(RunRow row, const Task& task)
    {
        if ((row.shard = m_shard))
            row.shard->task = task.number;
        m_rows.append(row);
        return row;
    }

    // Row in the file that this program made of a run, on this device; null if there is none. A shard takes rows of any
    // device, because each task has one row.
    const RunRow* known(const RowConfig& config, const std::string& backend)
    {
        const RunRow* row = m_rows.find(config.id);
        const bool same =
            row != nullptr && row->tool == thisTool() && (m_shard || row->device.name == m_measurer->deviceOf(backend));
        return same ? row : nullptr;
    }

    const SweepConfig& m_config;
    Reporter& m_log;
    RunRows m_rows; // opened before the model: a file that has other content is refused before any work
    std::shared_ptr<const Scene> m_scene;
    RunContext m_context;
    std::vector<Path> m_paths;
    NewWarnings m_new_warnings;
    std::vector<std::vector<std::string>> m_path_warnings; // a list for each path
    std::unique_ptr<Measurer> m_measurer;
    std::vector<RunConfig> m_runs;
    std::vector<Task> m_tasks;                // tasks of this shard
    std::vector<Measurer::Planned> m_planned; // those of them to be measured: without a row in the file
    std::optional<ShardFacts> m_shard;        // facts for its rows; none = the sweep is not split
    std::string m_given_shard;
    size_t m_runs_done = 0, m_planned_done = 0, m_found = 0;
};

} // namespace

void sweep(const BenchOptions& options, Reporter& log, const std::function<void(const RunRow&)>& show)
{
    const std::string text = readInputText(options.sweep, kMaxConfigBytes, "a sweep (schemas/sweep.schema.json)");
    const SweepConfig config =
        parseSweepConfig(text, options.sweep, {options.play.frame, options.play.devices.backend}, backendNames());
    checkOut(options, config, log.json());
    Sweep run(options, config, log);
    try {
        run.runAll(show);
    } catch (const Error& e) {
        if (e.code() != ErrorCode::Interrupted)
            throw;
        run.throwInterrupted(options.out);
    }
}

} // namespace gsc
