// SPDX-License-Identifier: Apache-2.0
#include "player/report/report_parts.h"

#include "format/error.h"
#include "player/report/reuse_names.h"
#include "player/tool/version.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>

namespace gsc {

double nearestRank(const std::vector<double>& sorted, double q)
{
    const auto rank = size_t(std::ceil(q * double(sorted.size())));
    return sorted[std::clamp<size_t>(rank, 1, sorted.size()) - 1];
}

Spread spreadOf(std::vector<double> values)
{
    if (values.empty())
        return {};
    std::sort(values.begin(), values.end());
    double sum = 0;
    for (const double v : values)
        sum += v;
    return {sum / double(values.size()), nearestRank(values, 0.5), nearestRank(values, 0.95), nearestRank(values, 0.99),
            values.back()};
}

OrderedJson spreadJson(const Spread& s)
{
    return {{"mean", s.mean}, {"median", s.median}, {"p95", s.p95}, {"p99", s.p99}, {"max", s.max}};
}

OrderedJson unknownIfZero(double value)
{
    return value > 0 ? OrderedJson(value) : OrderedJson();
}

OrderedJson toolJson()
{
    return {{"name", "gsc-play"},
            {"version", toolVersion()},
            {"commit", toolCommit().empty() ? OrderedJson() : OrderedJson(toolCommit())}};
}

OrderedJson deviceJson(const DeviceFacts& device)
{
    return {{"name", device.name},
            {"driver", device.driver.empty() ? OrderedJson() : OrderedJson(device.driver)},
            {"memory_bytes", device.memory_bytes},
            {"processors", device.processors},
            {"clock_mhz", unknownIfZero(device.clock_mhz)},
            {"memory_clock_mhz", unknownIfZero(device.memory_clock_mhz)},
            {"context_bytes", device.context_bytes > 0 ? OrderedJson(device.context_bytes) : OrderedJson()}};
}

OrderedJson fileJson(const std::string& path, uint64_t bytes, uint64_t anchors)
{
    return {{"path", path}, {"bytes", bytes}, {"anchors", anchors}};
}

OrderedJson reuseJson(const ReuseOptions& reuse)
{
    const bool depth = reuse.policy == ReusePolicy::Depth;
    return {{"policy", policyName(reuse.policy)},
            {"max_depth", depth ? OrderedJson(reuse.max_depth) : OrderedJson()},
            {"guidance", depth ? OrderedJson(guidanceName(reuse.guidance)) : OrderedJson()},
            {"bound", reuse.policy == ReusePolicy::Error ? OrderedJson(reuse.bound) : OrderedJson()},
            {"decode_budget", reuse.decode_budget > 0 ? OrderedJson(reuse.decode_budget) : OrderedJson()},
            {"cache_budget", reuse.cache_bytes > 0 ? OrderedJson(reuse.cache_bytes) : OrderedJson()}};
}

OrderedJson lodJson(const LodFacts& lod)
{
    OrderedJson used;
    if (lod.target_ms > 0 && !lod.used.empty()) {
        const auto [low, high] = std::minmax_element(lod.used.begin(), lod.used.end());
        used = {{"mean", spreadOf(lod.used).mean}, {"min", *low}, {"max", *high}};
    }
    return {{"lod_bias", lod.bias},
            {"lod_fade", lod.fade},
            {"lod_hysteresis", lod.hysteresis},
            {"target_ms", unknownIfZero(lod.target_ms)},
            {"lod_bias_used", std::move(used)}};
}

std::string targetText(const LodFacts& lod)
{
    if (!(lod.target_ms > 0) || lod.used.empty())
        return {};
    const auto [low, high] = std::minmax_element(lod.used.begin(), lod.used.end());
    return formatString("target %g ms: LOD bias %.2f mean, %.2f to %.2f\n", lod.target_ms, spreadOf(lod.used).mean,
                        *low, *high);
}

} // namespace gsc
