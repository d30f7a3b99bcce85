// SPDX-License-Identifier: Apache-2.0
// Content of a page of service traces, as data: page/service_figures.js turns it into figures, page/plain_report.js
// into text and tables.
#pragma once

#include "convert/chart/rows/trace_set.h"

#include <nlohmann/json.hpp>

#include <vector>

namespace gsc {

// {"version": of gsc, "kind": "service",
//  "facts": [[name, words], ...],
//  "panels": [{"title", "file_name", "words",                     one panel for each trace
//    "verdict": words,
//    "latency": {p50, p95, p99, max}, "min_fps", "max_fps",       the last two null without a limit
//    "end": seconds,
//    "rate": [[time, fps, workers], ...],
//    "poses": {"shown" | "late" | "expired" | "failed": [[ended, ms from submitted], ...]},   thinned
//    "distribution": {"step": ms, "counts": [...], "over": count,  poses in steps of latency from 0; poses above the last step
//                     "cdf": [[ms, percent], ...]},
//    "stages": [name, ...],
//    "workers": [{index, device, name, state, frames, parts, faults, busy_s, busy_share, load_ms, stage_s: [...],
//                 untold_s, last_fault}],                          untold: busy seconds in no stage
//    "events": [{time, kind, worker, cause, rate, workers}],
//    "events_cut": bool, true: the page lacks some}]}
// Numbers have five digits. Traces must not be empty.
nlohmann::ordered_json traceModel(const std::vector<ChartTrace>& traces);

constexpr size_t kMostTracePoses = 4000; // most poses that end alike; a figure has fewer pixels

} // namespace gsc
