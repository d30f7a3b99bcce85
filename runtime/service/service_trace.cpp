// SPDX-License-Identifier: Apache-2.0
#include "runtime/service/service_trace.h"

#include <algorithm>
#include <cmath>

namespace gsc {

namespace {

const double kWidth = std::log(1.02);
constexpr double kLeast = 1e-3; // lowest latency that is told apart, ms

} // namespace

const char* workerStateName(WorkerState state)
{
    constexpr const char* kNames[] = {"cold", "loading", "warm", "working", "retired", "gone"};
    return kNames[uint32_t(state)];
}

const char* traceEventName(TraceEvent::Kind kind)
{
    constexpr const char* kNames[] = {"start", "ready", "stop", "retire", "return", "plan"};
    return kNames[uint32_t(kind)];
}

const char* poseEndName(PoseEnd end)
{
    constexpr const char* kNames[] = {"shown", "late", "expired", "failed"};
    return kNames[uint32_t(end)];
}

void TraceRecord::note(TraceEvent::Kind kind, int worker, const std::string& cause)
{
    if (m_trace.events.size() < m_limit)
        m_trace.events.push_back({m_clock.now(), kind, worker, cause});
    else if (m_limit > 0)
        ++m_trace.left_out;
}

void TraceRecord::add(const TracePose& pose)
{
    if (m_trace.poses.size() < m_limit)
        m_trace.poses.push_back(pose);
    else if (m_limit > 0)
        ++m_trace.left_out;
}

void LatencyCounts::add(double ms)
{
    const double bucket = std::log(std::max(ms, kLeast) / kLeast) / kWidth;
    ++m_counts[std::min(size_t(bucket), kBuckets - 1)];
    ++m_count;
    m_most = std::max(m_most, ms);
}

// Returns the middle of the bucket below which `share` of the values lie.
double LatencyCounts::percentile(double share) const
{
    const auto wanted = uint64_t(std::ceil(share * double(m_count)));
    uint64_t sum = 0;
    for (size_t i = 0; i < kBuckets; ++i) {
        sum += m_counts[i];
        if (sum >= wanted)
            return std::min(kLeast * std::exp((double(i) + 0.5) * kWidth), m_most);
    }
    return m_most;
}

LatencyStats LatencyCounts::stats() const
{
    if (m_count == 0)
        return {};
    return {percentile(0.5), percentile(0.95), percentile(0.99), m_most};
}

} // namespace gsc
