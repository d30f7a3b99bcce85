// SPDX-License-Identifier: Apache-2.0
// Report of a renderer service's run, as one line of JSON (schemas/service-trace.schema.json): written by what runs it,
// read by gsc chart. Names are those of runtime/service/service_trace.h. Times are seconds since the service began.
#pragma once

#include "runtime/records/report_parts.h"

#include <array>
#include <string>
#include <vector>

namespace gsc {

constexpr const char* kServiceTraceSchema = "gsc.service-trace/1";

struct ServiceTraceReport {
    struct Options {
        std::string mode;                // of ServiceOptions: "auto", "frame", "eye" or "split"
        double rate = 0;                 // poses a second that were asked for; 0 = as fast as they were drawn
        double min_fps = 0, max_fps = 0; // of PaceRules; 0 = no limit
        bool keeps_all = false;
        std::vector<std::string> devices; // as they were named, one for each worker
    };
    struct Counts {
        uint64_t submitted = 0, shown = 0, late = 0, expired = 0, failed = 0;
        uint64_t still = 0;    // not drawn, because they were as good as the last
        uint64_t left_out = 0; // poses and events past the limit of the trace, which are missing below
    };
    struct Latency { // milliseconds, of poses shown
        double p50 = 0, p95 = 0, p99 = 0, max = 0;
    };
    struct Sample { // of an interval that ends at `time`
        double time = 0;
        double fps = 0;       // pictures shown
        uint64_t workers = 0; // that drew at its end
    };
    // Milliseconds of poses whose longest part was this worker's; in modes eye and split the others' are not told.
    using Stages = std::array<double, 6>; // kStageNames
    struct Worker {
        uint64_t index = 0;
        std::string device{}, name{}, state{}; // "cuda:1"; of the device; workerStateName() at the end
        uint64_t frames = 0;                   // whose longest part it drew
        uint64_t parts = 0, starts = 0, stops = 0, faults = 0;
        double busy_ms = 0, load_ms = 0;
        Stages stage_ms{};
        std::string last_fault;
    };
    struct Event {
        double time = 0;
        std::string kind;    // traceEventName()
        int64_t worker = -1; // -1 = none
        std::string cause;
        double rate = 0;      // pictures shown in the second before, per second
        uint64_t workers = 0; // that drew afterwards
    };
    struct Pose {
        uint64_t id = 0;
        double submitted = 0, ended = 0;
        double begun = -1;      // -1 = never
        std::string end;        // poseEndName()
        double latency_ms = -1; // -1 = not shown
        int64_t worker = -1;    // whose part took longest; -1 = none drew
        std::string mode{};     // how it was shared; empty = not told
        uint64_t attempts = 0;  // to draw it; 0 = not told
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
void describe(const Record& at, ServiceTraceReport& report); // with its schema

// From a line that states its schema. `where` names it in messages. Throws Error: InvalidFile, Unsupported (a newer form).
ServiceTraceReport parseServiceTrace(const OrderedJson& json, const std::string& where);

} // namespace gsc
