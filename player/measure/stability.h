// SPDX-License-Identifier: Apache-2.0
// gsc-play stability: does what is kept between frames hold on the paths that were made to break it?
#pragma once

#include "player/options/play_options.h"
#include "player/measure/runner.h"
#include "runtime/records/run_row.h"

#include <algorithm>
#include <string>
#include <vector>

namespace gsc {

struct StabilityOptions {
    PlayOptions play;                      // what and how to render; its cameras are not used
    std::vector<std::string> trajectories; // camera files, or folders of them
    uint32_t warmup = 5;                   // frames that the spreads of time leave out
    std::string reference;                 // backend that renders `exact`; empty = the measured one
    double bound_psnr = 50;                // least of any frame, dB; 0 = no bound
    double bound_temporal = 2;             // most of any frame, times the trajectory's median; 0 = no bound
    double bound_p99 = 0;                  // p99 of the frame time, times its median; 0 = no bound
    ScoreOptions score;                    // the frames that are judged by psnr; temporal needs all
    std::string out;                       // of a shard: file that takes a row for each trajectory
};

struct StabilitySummary {
    std::string backend, reference;
    std::vector<RunRow> rows;                // of each trajectory, with the part "stability"
    uint64_t all_paths = 0, rows_before = 0; // of all shards, and those that this one had done before

    [[nodiscard]] bool passed() const
    {
        return std::ranges::all_of(rows, [](const RunRow& row) { return row.stability->passed(); });
    }
};

// The bounds that are set, against a run.
std::vector<Verdict> judge(const StabilityOptions& options, const RunResult& run);

// Throws Error.
StabilitySummary stability(const StabilityOptions& options, Reporter& log);

// A table for a person.
std::string stabilityText(const StabilityOptions& options, const StabilitySummary& summary);

} // namespace gsc
