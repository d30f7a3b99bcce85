// SPDX-License-Identifier: Apache-2.0
// Makes the list of runs to do from the combinations of a sweep's file.
#include <gsc/error.h>
#include "player/measure/run_facts.h"
#include "player/options/shard.h"
#include "player/sweep/sweep_config.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <map>
#include <set>

namespace gsc {

namespace {

// Sets every setting without an effect under the policy or the tier to its default, so that runs of one effect are equal.
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
    if (reuse.policy == ReusePolicy::None) { // without reuse every anchor is decoded
        reuse.decode_budget = 0;
        reuse.cache_bytes = 0;
        run.match_budget = false;
    }
    run.detail = run.detailPixels();
    if (run.tier == Tier::Exact) // tier exact ignores foveation
        run.foveation = FoveationMode::None;
    return run;
}

// Collects runs, each once, in the order that they come.
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

} // namespace

RunConfig depthRunOf(const SweepConfig& config, const RunConfig& run)
{
    RunConfig depth = run;
    depth.match_budget = false;
    depth.reuse.decode_budget = 0;
    depth.reuse.policy = ReusePolicy::Depth;
    depth.reuse.max_depth = config.matched.max_depth;
    depth.reuse.guidance = config.matched.guidance;
    return collapsed(depth);
}

std::vector<RunConfig> expandRuns(const SweepConfig& config)
{
    RunList list;
    for (const RunConfig& run : config.runs)
        if ((run.stereo == StereoMode::Exact || run.reuse.policy != ReusePolicy::Error) &&
            (run.detailPixels() == 0 || run.reuse.policy == ReusePolicy::None))
            list.add(run);
    if (list.runs().empty())
        throw Error(ErrorCode::InvalidFile, "sweep",
                    "its axes join stereo merged only with the policy error, which bounds the change for each eye, or "
                    "detail only with policies that keep what was decoded themselves",
                    "a run", "add the stereo \"exact\", the detail 0, or the policy \"none\"");
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

std::vector<uint64_t> sweepShards(const SweepConfig& config, const std::vector<RunConfig>& runs,
                                  const std::vector<uint64_t>& frames, uint64_t count)
{
    std::map<std::string, size_t> places;
    for (size_t i = 0; i < runs.size(); ++i)
        places.try_emplace(runKeyJson(runs[i]).dump(), i);
    std::vector<size_t> leaders; // for each run the run whose shard it shares
    for (size_t i = 0; i < runs.size(); ++i)
        leaders.push_back(runs[i].match_budget ? places.at(runKeyJson(depthRunOf(config, runs[i])).dump()) : i);
    const auto leaderOf = [&](size_t task) { return task - task % runs.size() + leaders[task % runs.size()]; };
    std::vector<uint64_t> weights(frames.size(), 0);
    for (size_t task = 0; task < frames.size(); ++task)
        weights[leaderOf(task)] += frames[task];
    std::vector<uint64_t> shards = blockShards(weights, count);
    for (size_t task = 0; task < frames.size(); ++task)
        shards[task] = shards[leaderOf(task)];
    return shards;
}

} // namespace gsc
