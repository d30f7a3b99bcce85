// SPDX-License-Identifier: Apache-2.0
// gsc-play stability: does what is kept between frames hold on the paths that were made to break it?
#pragma once

#include "player/options/play_options.h"
#include "player/measure/runner.h"
#include "runtime/cli/json.h"

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
    std::string out;                       // of a shard: file that takes a line for each trajectory
};

struct Verdict {
    const char* bound; // "psnr", "temporal" or "p99"
    double limit, value;
    uint64_t frame = 0; // the worst, where there is one
    bool passed = true;
};

struct StabilityPath {
    std::string name, cameras;
    uint64_t frames = 0;
    double ipd = 0; // of two eyes
    FrameTimes ms;  // of the frames after the warm-up
    Accuracy accuracy;
    ReuseCounts reuse;
    std::vector<Verdict> verdicts;
    Tier tier = Tier::Exact; // that ran
    DeviceFacts device;      // asked for after the last timed frame

    [[nodiscard]] bool passed() const { return std::ranges::all_of(verdicts, &Verdict::passed); }
};

struct StabilitySummary {
    std::string backend, reference;
    FileFacts file;
    std::vector<StabilityPath> paths;
    std::vector<std::string> warnings;
    uint64_t all_paths = 0, paths_before = 0; // of all shards, and those that this one had done before

    [[nodiscard]] bool passed() const { return std::ranges::all_of(paths, &StabilityPath::passed); }
};

// The bounds that are set, against a run.
std::vector<Verdict> judge(const StabilityOptions& options, const RunResult& run);

// Throws Error.
StabilitySummary stability(const StabilityOptions& options, Reporter& log);

std::string stabilityReportText(const StabilityOptions& options, const StabilitySummary& summary);
// One object, schemas/stability-report.schema.json; what a shard is, if there is one and it is asked for.
std::string stabilityReportJson(const StabilityOptions& options, const StabilitySummary& summary,
                                bool tells_shard = true);

// The line of one trajectory: a report of it alone, without the shard. And back: what the report of all says of it.
std::string stabilityRow(const StabilityOptions& options, const StabilitySummary& summary, const StabilityPath& path);
StabilityPath readStabilityRow(const OrderedJson& row, const std::string& where);

} // namespace gsc
