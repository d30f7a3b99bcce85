// SPDX-License-Identifier: Apache-2.0
// The file of --sweep (schemas/sweep.schema.json) and the runs it asks for.
#pragma once

#include "runtime/records/score_options.h"
#include "player/options/run_config.h"

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace gsc {

struct SweepConfig {
    std::vector<std::string> trajectories; // as the file lists them; "stored" = the cameras in the model
    uint32_t width = 0, height = 0;        // 0 = the command line's
    double fov_degrees = 0;                // horizontal, 0 = the command line's
    int eyes = 0;                          // 0 = the command line's
    uint64_t frames = 0;                   // first so many of each trajectory, 0 = all
    uint32_t warmup = 5;                   // frames that the spreads of time leave out
    ScoreOptions score;
    std::vector<RunConfig> runs; // the product of the axes, then the listed ones; some may be equal
    ReuseOptions matched;        // has the depth and the guidance of the run that a "match" budget is taken from
};

// `base` gives what the file leaves out; `backends` are the names it may use. Throws Error(InvalidFile) naming the key
// and what was expected there.
SweepConfig parseSweepConfig(std::string_view json, const std::string& file, const RunConfig& base,
                             const std::vector<std::string>& backends);
// The runs, less what keeps what each eye decoded while both are decoded at once, collapsed, each once, by backend; a
// run whose budget is that of another one comes after it, and that one is there even if nothing else asks for it.
std::vector<RunConfig> expandRuns(const SweepConfig& config);

// The run whose decodes a "match" budget takes: reuse by depth with the first depth and guidance of the axes, no
// budget, and otherwise the same.
RunConfig depthRunOf(const SweepConfig& config, const RunConfig& run);

// The shard of each task, from 0. `frames` has those of the tasks, all runs of a path side by side, 0 for one that is not
// done. Shards are blocks of about as many frames, so that most paths have their exact images rendered by one only. A run
// whose budget is that of another one goes with it.
std::vector<uint64_t> sweepShards(const SweepConfig& config, const std::vector<RunConfig>& runs,
                                  const std::vector<uint64_t>& frames, uint64_t count);

} // namespace gsc
