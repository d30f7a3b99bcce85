// SPDX-License-Identifier: Apache-2.0
// Counts of a renderer service while it runs, and a record of every pose and worker for those who ask for one.
#pragma once

#include <gsc/device.h>
#include "runtime/service/policy/frame_cost.h"
#include "runtime/service/policy/mode_choice.h"
#include "runtime/service/pose_ledger.h"

namespace gsc {

enum class WorkerState : uint32_t {
    Cold,    // without a renderer
    Loading, // makes one
    Warm,    // has the model, does not draw
    Working,
    Retired, // after a fault, comes back
    Gone,    // after too many, or for a fault that no time mends
};

const char* workerStateName(WorkerState state);

struct WorkerStats {
    DeviceId device;
    std::string name; // of the device
    WorkerState state = WorkerState::Cold;
    uint64_t parts = 0; // drawn
    double busy_ms = 0; // with them
    double load_ms = 0; // to be ready, the last time
    uint32_t starts = 0, stops = 0, faults = 0;
    std::string last_fault; // what it said
};

// Milliseconds, of poses shown: from submit() to next().
struct LatencyStats {
    double p50 = 0, p95 = 0, p99 = 0, most = 0; // within 2 %
};

struct ServiceStats {
    LedgerCounts counts;
    uint64_t still = 0; // poses that were not drawn because they were as good as the last
    LatencyStats latency;
    double rate = 0;           // that the workers can draw, frames per second; 0 = not known yet
    double predicted_rate = 0; // of frames to come
    uint32_t working = 0;      // workers that draw
    SharePlan plan;
    std::string plan_cause; // why the plan is what it is, of ServiceMode::Auto
    std::vector<WorkerStats> workers;
};

struct TraceEvent {
    enum class Kind : uint32_t { Start, Ready, Stop, Retire, Return, Plan };
    ServiceTime at{0};
    Kind kind = Kind::Start;
    int worker = -1; // -1 = none
    std::string cause;
};

const char* traceEventName(TraceEvent::Kind kind);

struct TracePose {
    uint64_t pose = 0;
    ServiceTime submitted{0}, ended{0};
    std::optional<ServiceTime> begun;
    PoseEnd end = PoseEnd::Shown;
    int worker = -1; // whose part took longest, -1 = none drew
    StageTimes stages;
    FrameLoad load;
};

const char* poseEndName(PoseEnd end);

struct ServiceTrace {
    std::vector<TraceEvent> events;
    std::vector<TracePose> poses;
    uint64_t left_out = 0; // poses and events past the limit
};

// Keeps a trace up to a limit. Every call is made with the service's mutex held.
class TraceRecord {
public:
    TraceRecord(size_t limit, const ServiceClock& clock) : m_limit(limit), m_clock(clock) {}

    void note(TraceEvent::Kind kind, int worker, const std::string& cause); // now
    void add(const TracePose& pose);
    [[nodiscard]] const ServiceTrace& trace() const { return m_trace; }

private:
    const size_t m_limit; // of poses, and of events
    const ServiceClock& m_clock;
    ServiceTrace m_trace;
};

// Counts values in buckets 2 % wide, of a fixed size.
class LatencyCounts {
public:
    void add(double ms);
    [[nodiscard]] LatencyStats stats() const;

private:
    [[nodiscard]] double percentile(double share) const;

    static constexpr size_t kBuckets = 1200; // from 1 us; the last is over 5 hours
    std::vector<uint32_t> m_counts = std::vector<uint32_t>(kBuckets);
    uint64_t m_count = 0;
    double m_most = 0;
};

} // namespace gsc
