// SPDX-License-Identifier: Apache-2.0
// The file of --sweep (schemas/sweep.schema.json) and its runs.
#pragma once

#include "runtime/records/score_options.h"
#include "player/options/run_config.h"

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace gsc {

// Content of the file.
struct SweepConfig {
    std::vector<std::string> trajectories; // files of cameras; "stored" = the cameras in the model
    uint32_t width = 0, height = 0;        // pixels; 0 = as on the command line
    double fov_degrees = 0;                // horizontal; 0 = as on the command line
    int eyes = 0;                          // 0 = as on the command line
    uint64_t frames = 0;                   // frames from the start of each trajectory; 0 = all
    uint32_t warmup = 5;                   // frames without a part in the statistics of time
    ScoreOptions score;
    std::vector<RunConfig> runs; // all combinations of the axes, then the listed runs; some may be equal
    ReuseOptions matched;        // depth and guidance of the run whose decodes a budget of "match" is
};

// Content of a file. `base` has the values of keys that are not in the file; `backends` are the names allowed in it. Throws
// Error(InvalidFile) that names the key and the right values.
SweepConfig parseSweepConfig(std::string_view json, const std::string& file, const RunConfig& base,
                             const std::vector<std::string>& backends);
// Runs to do, each once, ordered by backend. Settings without an effect are set to their defaults; combinations that no
// backend draws, such as stereo merged with policy error, are left out. A run with a budget of "match" comes after its
// depthRunOf(), which is added if the file does not list it.
std::vector<RunConfig> expandRuns(const SweepConfig& config);

// Run whose decodes are the budget of a run with "match": reuse by depth with the first depth and guidance of the axes,
// without a budget, and with all other settings of `run`.
RunConfig depthRunOf(const SweepConfig& config, const RunConfig& run);

// Shard of each task, from 0. `frames`: frames of each task, the runs of a path side by side; 0 for a task that is not done.
// Shards are blocks of about equal frames, so that the exact images of most paths are drawn by one shard only. A run with a
// budget of "match" is in the shard of its depthRunOf().
std::vector<uint64_t> sweepShards(const SweepConfig& config, const std::vector<RunConfig>& runs,
                                  const std::vector<uint64_t>& frames, uint64_t count);

} // namespace gsc
