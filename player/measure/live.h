// SPDX-License-Identifier: Apache-2.0
// gsc-play live: a trajectory fed in real time, as a viewer feeds its poses.
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
    PlayOptions play;                             // its outputs are not used
    double rate = 90;                             // poses per second
    double seconds = 0;                           // going round the cameras; 0 = once through them
    double timeout_ms = 50;                       // longest wait of a pose before it is begun
    double still_distance = 0, still_degrees = 0; // ServiceOptions
    std::string trace; // file that takes the trace, empty = none; OutputChoice::overwrite is its
};

struct LiveSummary {
    FileFacts file;
    Tier tier = Tier::Exact;
    double seconds = 0; // from the first pose until the last had ended
    ServiceStats service;
    ServiceTrace trace;
    std::vector<std::string> devices; // as they were named
    std::vector<std::string> warnings;
};

// Pictures are gathered on the first device and given back at once. Throws Error.
LiveSummary live(const LiveOptions& options, Reporter& log);

// schemas/service-trace.schema.json
ServiceTraceReport liveTrace(const LiveOptions& options, const LiveSummary& summary);

// Some lines for a person.
std::string liveReportText(const LiveOptions& options, const LiveSummary& summary);

} // namespace gsc
