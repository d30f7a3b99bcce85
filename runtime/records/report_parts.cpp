// SPDX-License-Identifier: Apache-2.0
#include "runtime/records/report_parts.h"

#include <gsc/error.h>
#include "runtime/records/reuse_names.h"
#include "runtime/cli/version.h"

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

OrderedJson unknownIfZero(double value)
{
    return value > 0 ? OrderedJson(value) : OrderedJson();
}

std::string decibels(double psnr, const char* unit)
{
    return std::isinf(psnr) && psnr > 0 ? "identical" : formatString("%.*f%s", psnr < 99.995 ? 2 : 1, psnr, unit);
}

ToolFacts thisTool()
{
    return {"gsc-play", toolVersion(), toolCommit()};
}

ReuseFacts reuseFacts(const ReuseOptions& reuse)
{
    ReuseFacts facts{policyName(reuse.policy), -1, "", -1, reuse.decode_budget, reuse.cache_bytes};
    if (reuse.policy == ReusePolicy::Depth) {
        facts.max_depth = reuse.max_depth;
        facts.guidance = guidanceName(reuse.guidance);
    }
    if (reuse.policy == ReusePolicy::Error)
        facts.bound = reuse.bound;
    return facts;
}

void describe(const Record& at, Spread& spread)
{
    at.field("mean", spread.mean, kPositive);
    at.field("median", spread.median, kPositive);
    at.field("p95", spread.p95, kPositive);
    at.field("p99", spread.p99, kPositive);
    at.field("max", spread.max, kPositive);
}

void describe(const Record& at, ToolFacts& tool)
{
    at.field("name", tool.name, kName);
    at.field("version", tool.version, kText);
    at.fieldOrNull("commit", tool.commit, kText);
}

void describe(const Record& at, FileFacts& file)
{
    at.field("path", file.path, kName);
    at.field("bytes", file.bytes, kCount);
    at.field("anchors", file.anchors, kCount);
}

void describe(const Record& at, DeviceFacts& device)
{
    at.field("name", device.name, kText);
    at.fieldOrNull("driver", device.driver, kText);
    at.field("memory_bytes", device.memory_bytes, kCount);
    at.field("processors", device.processors, kCount);
    at.fieldOrNull("clock_mhz", device.clock_mhz, kPositive);
    at.fieldOrNull("memory_clock_mhz", device.memory_clock_mhz, kPositive);
    at.fieldOrNull("context_bytes", device.context_bytes, kCount);
}

void describe(const Record& at, ReuseFacts& reuse)
{
    at.field("policy", reuse.policy, kName);
    at.fieldOrNull("max_depth", reuse.max_depth, kCount, int64_t(-1));
    at.fieldOrNull("guidance", reuse.guidance, kText);
    at.fieldOrNull("bound", reuse.bound, kPositive, -1.0);
    at.fieldOrNull("decode_budget", reuse.decode_budget, kCount);
    at.fieldOrNull("cache_budget", reuse.cache_budget, kCount);
}

} // namespace gsc
