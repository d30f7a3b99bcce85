// SPDX-License-Identifier: Apache-2.0
// The file of --sweep (schemas/sweep.schema.json) and the runs it asks for.
#pragma once

#include "kernels/frame/frame_types.h"
#include "player/measure/accuracy.h"

#include <nlohmann/json_fwd.hpp>

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace gsc {

// One combination of what a sweep varies.
struct RunConfig {
    std::string backend = "auto";
    Tier tier = Tier::Fast;
    double lod_bias = 0, lod_fade = 0, lod_hysteresis = 0;
    StereoMode stereo = StereoMode::Exact;
    ReuseOptions reuse;
    bool match_budget = false; // the decode budget is what the run of depthRunOf() decodes
};

// Every value of an axis is a value that a run may have; an axis that the file leaves out has the command line's.
struct SweepAxes {
    std::vector<ReusePolicy> policies;
    std::vector<uint32_t> depths;
    std::vector<DepthGuidance> guidances;
    std::vector<float> bounds;
    struct Budget {
        uint64_t anchors = 0; // 0 = no limit
        bool match = false;
    };
    std::vector<Budget> decode_budgets;
    std::vector<uint64_t> cache_budgets; // bytes, 0 = no limit
    std::vector<Tier> tiers;
    std::vector<double> lod_biases, lod_fades, lod_hystereses;
    std::vector<StereoMode> stereos;
    std::vector<std::string> backends;
};

struct SweepConfig {
    std::vector<std::string> trajectories; // as the file lists them; "stored" = the cameras in the model
    uint32_t width = 0, height = 0;        // 0 = the command line's
    double fov_degrees = 0;                // horizontal, 0 = the command line's
    int eyes = 0;                          // 0 = the command line's
    uint64_t frames = 0;                   // first so many of each trajectory, 0 = all
    uint32_t warmup = 5;                   // frames that the spreads of time leave out
    ScoreOptions score;
    SweepAxes axes;
    bool has_axes = false;
    std::vector<RunConfig> runs; // beside the product of the axes
};

// `base` gives what the file leaves out; `backends` are the names it may use. Throws Error(InvalidFile) naming the key
// and what was expected there.
SweepConfig parseSweepConfig(std::string_view json, const std::string& file, const RunConfig& base,
                             const std::vector<std::string>& backends);
// Throws Error (Io, InvalidFile).
SweepConfig readSweepConfig(const std::string& path, const RunConfig& base, const std::vector<std::string>& backends);

// Sets what the policy does not look at to its default, so that equal runs are equal.
RunConfig collapsed(RunConfig run);

// The product of the axes, less what keeps what each eye decoded while both are decoded at once, and the explicit runs, collapsed, each once, by backend; a run whose budget is that of
// another one comes after it, and that one is there even if nothing else asks for it.
std::vector<RunConfig> expandRuns(const SweepConfig& config);

// The run whose decodes a "match" budget takes: reuse by depth with the first depth and guidance of the axes, no
// budget, and otherwise the same.
RunConfig depthRunOf(const SweepConfig& config, const RunConfig& run);

// What makes a run differ from another, in the words of schemas/run.schema.json.
nlohmann::ordered_json runKeyJson(const RunConfig& run);
bool sameRun(const RunConfig& a, const RunConfig& b);

} // namespace gsc
