// SPDX-License-Identifier: Apache-2.0
// Trace of a renderer service's run, as one line of JSON (schemas/service-trace.schema.json): written by gsc-play,
// read by gsc chart. Names are those of runtime/service/service_trace.h. Times are seconds since the service began.
#pragma once

#include "runtime/records/report_parts.h"

#include <array>
#include <string>
#include <vector>

namespace gsc {

constexpr const char* kServiceTraceSchema = "gsc.service-trace/1";

// Trace of a service: options, totals, events, and the history of each worker and each pose.
struct ServiceTraceReport {
    struct Options {
        std::string mode;                 // mode of ServiceOptions: "auto", "frame", "eye" or "split"
        double rate = 0;                  // poses submitted per second; 0 = as fast as they were drawn
        double min_fps = 0, max_fps = 0;  // limits of PaceRules, pictures per second; 0 = no limit
        bool keeps_all = false;           // all poses are drawn, also if a newer pose waits
        std::vector<std::string> devices; // names as on the command line, one for each worker
    };
    struct Counts {
        uint64_t submitted = 0, shown = 0, late = 0, expired = 0, failed = 0;
        uint64_t still = 0;    // poses not drawn, because the last picture was close enough
        uint64_t left_out = 0; // poses and events beyond the limit of the trace, which are not in `poses` and `events`
    };
    struct Latency { // milliseconds from submitted to shown, over the shown poses
        double p50 = 0, p95 = 0, p99 = 0, max = 0;
    };
    struct Sample { // rate over an interval that ends at `time`
        double time = 0;
        double fps = 0;       // pictures shown per second
        uint64_t workers = 0; // workers that drew at its end
    };
    // Milliseconds of the stages of a worker, over poses whose longest part it drew; other parts in modes eye and split are
    // not counted.
    using Stages = std::array<double, 6>; // in the order of kStageNames
    struct Worker {
        uint64_t index = 0;
        std::string device{}, name{}, state{}; // "cuda:1"; the device's own name; workerStateName() at the end
        uint64_t frames = 0;                   // frames whose longest part it drew
        uint64_t parts = 0, starts = 0, stops = 0, faults = 0;
        double busy_ms = 0, load_ms = 0;
        Stages stage_ms{};
        std::string last_fault;
    };
    struct Event {
        double time = 0;
        std::string kind;    // a traceEventName()
        int64_t worker = -1; // -1 = none
        std::string cause;
        double rate = 0;      // pictures shown in the second before, per second
        uint64_t workers = 0; // workers that drew afterwards
    };
    struct Pose {
        uint64_t id = 0;
        double submitted = 0, ended = 0;
        double begun = -1;      // -1 = never
        std::string end;        // a poseEndName()
        double latency_ms = -1; // -1 = not shown
        int64_t worker = -1;    // worker whose part took longest; -1 = none drew
        std::string mode{};     // mode in which workers shared it; empty = not known
        uint64_t attempts = 0;  // times that it was drawn; 0 = not known
    };

    ToolFacts tool;
    std::string file;
    Options options;
    Counts counts;
    Latency latency;
    std::vector<Sample> rate;
    std::vector<Worker> workers;
    std::vector<Event> events;
    std::vector<Pose> poses;
};

constexpr std::array<const char*, 6> kStageNames = {"select", "decode", "project", "bin", "sort", "blend"};

void describe(const Record& at, ServiceTraceReport::Sample& sample);
void describe(const Record& at, ServiceTraceReport::Worker& worker);
void describe(const Record& at, ServiceTraceReport::Event& event);
void describe(const Record& at, ServiceTraceReport::Pose& pose);
void describe(const Record& at, ServiceTraceReport& report); // with the field "schema"

// Trace of a line that states its schema. `where` names the line in messages. Throws Error: InvalidFile; Unsupported for a
// newer form.
ServiceTraceReport parseServiceTrace(const OrderedJson& json, const std::string& where);

} // namespace gsc
