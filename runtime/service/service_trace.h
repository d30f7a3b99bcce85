// SPDX-License-Identifier: Apache-2.0
// Counts of a renderer service while it runs and, if asked for, a trace of every pose and every event of a worker.
#pragma once

#include <gsc/device.h>
#include "runtime/service/policy/frame_cost.h"
#include "runtime/service/policy/mode_choice.h"
#include "runtime/service/pose_ledger.h"

namespace gsc {

enum class WorkerState : uint32_t {
    Cold,    // the worker has no renderer
    Loading, // the worker makes a renderer and loads the model
    Warm,    // the worker has the model, but does not draw now
    Working,
    Retired, // the worker had a fault, and will come back after a pause
    Gone,    // the worker had too many faults, or one that waiting does not cure; it does not come back
};

const char* workerStateName(WorkerState state);

struct WorkerStats {
    DeviceId device;
    std::string name; // name of the worker's device
    WorkerState state = WorkerState::Cold;
    uint64_t parts = 0; // number of parts drawn
    double busy_ms = 0; // time spent on drawing parts, ms
    double load_ms = 0; // time that the last loading of the model took, ms
    uint32_t starts = 0, stops = 0, faults = 0;
    std::string last_fault; // message of the last fault
};

// Latency of poses that were shown: milliseconds from submit() to next().
struct LatencyStats {
    double p50 = 0, p95 = 0, p99 = 0, most = 0; // percentiles, with an error of up to 2 %; `most` is the largest
};

struct ServiceStats {
    LedgerCounts counts;
    uint64_t still = 0; // poses that were not drawn because the eyes hardly moved (still_distance)
    LatencyStats latency;
    double rate = 0;           // frames per second that the workers can draw; 0 = not known yet
    double predicted_rate = 0; // predicted rate of the next frames; 0 = not known yet
    uint32_t working = 0;      // number of workers that draw
    SharePlan plan;
    std::string plan_cause; // reason why ServiceMode::Auto chose the plan, in words
    std::vector<WorkerStats> workers;
};

struct TraceEvent {
    enum class Kind : uint32_t { Start, Ready, Stop, Retire, Return, Plan };
    ServiceTime at{0};
    Kind kind = Kind::Start;
    int worker = -1; // index of the worker, -1 = none
    std::string cause;
};

const char* traceEventName(TraceEvent::Kind kind);

struct TracePose {
    uint64_t pose = 0;
    ServiceTime submitted{0}, ended{0};
    std::optional<ServiceTime> begun;
    PoseEnd end = PoseEnd::Shown;
    int worker = -1; // worker of the part that took longest, -1 = none drew
    StageTimes stages;
    FrameLoad load;
};

const char* poseEndName(PoseEnd end);

struct ServiceTrace {
    std::vector<TraceEvent> events;
    std::vector<TracePose> poses;
    uint64_t left_out = 0; // poses and events that were left out because of the limit
};

// Collects a trace up to a limit. The service's mutex must be held in every call.
class TraceRecord {
public:
    TraceRecord(size_t limit, const ServiceClock& clock) : m_limit(limit), m_clock(clock) {}

    void note(TraceEvent::Kind kind, int worker, const std::string& cause); // adds an event at the present time
    void add(const TracePose& pose);
    [[nodiscard]] const ServiceTrace& trace() const { return m_trace; }

private:
    const size_t m_limit; // largest number of poses, and of events, that are kept
    const ServiceClock& m_clock;
    ServiceTrace m_trace;
};

// Counts values in a fixed number of buckets, each 2 % wide.
class LatencyCounts {
public:
    void add(double ms);
    [[nodiscard]] LatencyStats stats() const;

private:
    [[nodiscard]] double percentile(double share) const;

    static constexpr size_t kBuckets = 1200; // buckets for values from 1 us to more than 5 hours
    std::vector<uint32_t> m_counts = std::vector<uint32_t>(kBuckets);
    uint64_t m_count = 0;
    double m_most = 0;
};

} // namespace gsc
