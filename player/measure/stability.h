// SPDX-License-Identifier: Apache-2.0
// gsc-play stability: tests pictures on paths that are hard for reuse, which keeps work from earlier frames.
#pragma once

#include "player/options/play_options.h"
#include "player/measure/runner.h"
#include "runtime/records/run_row.h"

#include <algorithm>
#include <string>
#include <vector>

namespace gsc {

struct StabilityOptions {
    PlayOptions play;                      // model and rendering; its cameras are not used
    std::vector<std::string> trajectories; // camera files, or folders of them
    uint32_t warmup = 5;                   // frames without a part in the statistics of time
    std::string reference;                 // backend that draws the exact images; empty = the measured one
    double bound_psnr = 50;                // least PSNR of a frame, dB; 0 = no bound
    double bound_temporal = 2;             // most change of a frame, in medians of its trajectory; 0 = no bound
    double bound_p99 = 0;                  // most p99 of the frame time, in medians; 0 = no bound
    ScoreOptions score;                    // frames that bound_psnr judges; bound_temporal needs consecutive ones
    std::string out;                       // only of a shard: file for a row of each trajectory
};

// Result of a test, or of a shard of it.
struct StabilitySummary {
    std::string backend, reference;
    std::vector<RunRow> rows;                // one for each trajectory, with the part "stability"
    uint64_t all_paths = 0, rows_before = 0; // trajectories of all shards; rows that this shard had before

    [[nodiscard]] bool passed() const
    {
        return std::ranges::all_of(rows, [](const RunRow& row) { return row.stability->passed(); });
    }
};

// Verdict on a run for each bound that is set.
std::vector<Verdict> judge(const StabilityOptions& options, const RunResult& run);

// Measures all trajectories, or those of a shard. Throws Error.
StabilitySummary stability(const StabilityOptions& options, Reporter& log);

// Result as a table for a person.
std::string stabilityText(const StabilityOptions& options, const StabilitySummary& summary);

} // namespace gsc
