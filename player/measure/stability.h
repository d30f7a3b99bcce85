// SPDX-License-Identifier: Apache-2.0
// gsc-play stability: does what is kept between frames hold on the paths that were made to break it?
#pragma once

#include "player/measure/runner.h"

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
};

struct Verdict {
    const char* bound; // "psnr", "temporal" or "p99"
    double limit, value;
    uint64_t frame = 0; // the worst, where there is one
    bool passed = true;
};

struct StabilityPath {
    Path path;
    RunResult run;
    std::vector<Verdict> verdicts;

    [[nodiscard]] bool passed() const { return std::ranges::all_of(verdicts, &Verdict::passed); }
};

struct StabilitySummary {
    std::string backend, reference;
    FileFacts file;
    std::vector<StabilityPath> paths;
    std::vector<std::string> warnings;

    [[nodiscard]] bool passed() const { return std::ranges::all_of(paths, &StabilityPath::passed); }
};

// The bounds that are set, against a run.
std::vector<Verdict> judge(const StabilityOptions& options, const RunResult& run);

// Throws Error.
StabilitySummary stability(const StabilityOptions& options, Reporter& log);

std::string stabilityReportText(const StabilityOptions& options, const StabilitySummary& summary);
// One object, schemas/stability-report.schema.json.
std::string stabilityReportJson(const StabilityOptions& options, const StabilitySummary& summary);

} // namespace gsc
