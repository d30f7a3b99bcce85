// SPDX-License-Identifier: Apache-2.0
// From what a sweep asks for to the runs it takes.
#include "format/error.h"
#include "player/report/report_parts.h"
#include "player/report/reuse_names.h"
#include "player/sweep/sweep_config.h"
#include "runtime/frame_stats.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <set>

namespace gsc {

namespace {

constexpr uint64_t kMaxRuns = 100000; // per trajectory, before equal ones fall together

// Collects runs, each once, in the order they come.
class RunList {
public:
    void add(const RunConfig& run)
    {
        const RunConfig plain = collapsed(run);
        if (m_keys.insert(runKeyJson(plain).dump()).second)
            m_runs.push_back(plain);
    }
    [[nodiscard]] std::vector<RunConfig>& runs() { return m_runs; }

private:
    std::set<std::string> m_keys;
    std::vector<RunConfig> m_runs;
};

void addReuse(const SweepAxes& axes, RunConfig run, RunList& list)
{
    for (const ReusePolicy policy : axes.policies)
        for (const uint32_t depth : axes.depths)
            for (const DepthGuidance guidance : axes.guidances)
                for (const float bound : axes.bounds)
                    for (const SweepAxes::Budget& budget : axes.decode_budgets)
                        for (const uint64_t cache : axes.cache_budgets) {
                            run.reuse = {policy, depth, guidance, bound, budget.anchors, cache};
                            run.match_budget = budget.match;
                            if (run.stereo == StereoMode::Exact || policy != ReusePolicy::Error)
                                list.add(run);
                        }
}

// Throws Error(InvalidFile) where the product is larger than any sweep that ends.
void checkProduct(const SweepAxes& axes)
{
    uint64_t product = 1;
    for (const size_t size :
         {axes.policies.size(), axes.depths.size(), axes.guidances.size(), axes.bounds.size(),
          axes.decode_budgets.size(), axes.cache_budgets.size(), axes.tiers.size(), axes.lod_biases.size(),
          axes.lod_fades.size(), axes.lod_hystereses.size(), axes.stereos.size(), axes.backends.size()})
        if (product *= size; product > kMaxRuns) // an axis has at most some millions of values: no overflow
            throw Error(ErrorCode::InvalidFile,
                        formatString("sweep: its axes have more than %llu combinations, expected fewer; shorten an "
                                     "axis or list runs",
                                     static_cast<unsigned long long>(kMaxRuns)));
}

} // namespace

RunConfig collapsed(RunConfig run)
{
    const ReuseOptions defaults;
    ReuseOptions& reuse = run.reuse;
    if (run.match_budget)
        reuse.decode_budget = 0;
    if (reuse.policy != ReusePolicy::Depth) {
        reuse.max_depth = defaults.max_depth;
        reuse.guidance = defaults.guidance;
    }
    if (reuse.policy != ReusePolicy::Error)
        reuse.bound = defaults.bound;
    if (reuse.policy == ReusePolicy::None) { // nothing is kept: every anchor is decoded
        reuse.decode_budget = 0;
        reuse.cache_bytes = 0;
        run.match_budget = false;
    }
    return run;
}

nlohmann::ordered_json runKeyJson(const RunConfig& run)
{
    OrderedJson json = {{"backend", run.backend},
                        {"tier", tierName(run.tier)},
                        {"lod_bias", run.lod_bias + 0.0},
                        {"stereo", stereoName(run.stereo)}};
    if (run.lod_fade != 0) // where they are off, runs have the ids they had before there was such a thing
        json["lod_fade"] = run.lod_fade;
    if (run.lod_hysteresis != 0)
        json["lod_hysteresis"] = run.lod_hysteresis;
    json.update(reuseJson(run.reuse));
    if (run.match_budget)
        json["decode_budget"] = "match";
    return json;
}

bool sameRun(const RunConfig& a, const RunConfig& b)
{
    return runKeyJson(a) == runKeyJson(b);
}

RunConfig depthRunOf(const SweepConfig& config, const RunConfig& run)
{
    RunConfig depth = run;
    depth.match_budget = false;
    depth.reuse.decode_budget = 0;
    depth.reuse.policy = ReusePolicy::Depth;
    const ReuseOptions defaults;
    depth.reuse.max_depth = config.has_axes ? config.axes.depths.front() : defaults.max_depth;
    depth.reuse.guidance = config.has_axes ? config.axes.guidances.front() : defaults.guidance;
    return collapsed(depth);
}

std::vector<RunConfig> expandRuns(const SweepConfig& config)
{
    RunList list;
    if (config.has_axes) {
        checkProduct(config.axes);
        RunConfig run;
        for (const std::string& backend : config.axes.backends)
            for (const Tier tier : config.axes.tiers)
                for (const double bias : config.axes.lod_biases)
                    for (const double fade : config.axes.lod_fades)
                        for (const double hysteresis : config.axes.lod_hystereses)
                            for (const StereoMode stereo : config.axes.stereos) {
                                run.backend = backend;
                                run.tier = tier;
                                run.lod_bias = bias;
                                run.lod_fade = fade;
                                run.lod_hysteresis = hysteresis;
                                run.stereo = stereo;
                                addReuse(config.axes, run, list);
                            }
    }
    for (const RunConfig& run : config.runs)
        list.add(run);
    if (list.runs().empty())
        throw Error(ErrorCode::InvalidFile,
                    "sweep: its axes join stereo merged only with the policy error, which bounds "
                    "the change for each eye, expected a run; add \"exact\", or the policy \"depth\" or "
                    "\"none\"");
    const std::vector<RunConfig> asked = list.runs();
    for (const RunConfig& run : asked)
        if (run.match_budget)
            list.add(depthRunOf(config, run));

    std::vector<std::string> backends;
    for (const RunConfig& run : list.runs())
        if (std::find(backends.begin(), backends.end(), run.backend) == backends.end())
            backends.push_back(run.backend);
    std::vector<RunConfig> ordered;
    for (const std::string& backend : backends)
        for (const bool match : {false, true})
            for (const RunConfig& run : list.runs())
                if (run.backend == backend && run.match_budget == match)
                    ordered.push_back(run);
    return ordered;
}

} // namespace gsc
