// SPDX-License-Identifier: Apache-2.0
// gsc-play live: submits the poses of a trajectory to a service in real time, as a viewer does.
#pragma once

#include "player/options/play_options.h"
#include "runtime/records/frame_numbers.h"
#include "runtime/records/service_trace_report.h"
#include "runtime/cli/reporter.h"
#include "runtime/service/renderer_service.h"

#include <string>
#include <vector>

namespace gsc {

struct LiveOptions {
    PlayOptions play;                             // model, cameras and rendering; its outputs are not used
    double rate = 90;                             // poses per second
    double seconds = 0;                           // length of the run, round the cameras; 0 = once through them
    double timeout_ms = 50;                       // longest wait of a pose before it is begun
    double still_distance = 0, still_degrees = 0; // values of ServiceOptions
    std::string trace; // file for the trace, which OutputChoice::overwrite lets replace; empty = none
};

// Result of a run.
struct LiveSummary {
    FileFacts file;
    Tier tier = Tier::Exact;
    double seconds = 0; // time between the first pose and the end of the last
    ServiceStats service;
    ServiceTrace trace;
    std::vector<std::string> devices; // names as on the command line
    std::vector<std::string> warnings;
};

// Runs the service. Pictures come to the first device and are released at once. Throws Error.
LiveSummary live(const LiveOptions& options, Reporter& log);

// Trace of the run, for schemas/service-trace.schema.json.
ServiceTraceReport liveTrace(const LiveOptions& options, const LiveSummary& summary);

// Result as lines for a person.
std::string liveReportText(const LiveOptions& options, const LiveSummary& summary);

} // namespace gsc
