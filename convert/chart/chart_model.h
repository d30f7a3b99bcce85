// SPDX-License-Identifier: Apache-2.0
// Content of a page, as data: page/figures.js turns it into figures, page/report.js into text and tables.
#pragma once

#include "convert/chart/rows/run_set.h"

#include <nlohmann/json.hpp>

#include <string>

namespace gsc {

// {"version": of gsc,
//  "facts": [[name, words], ...],                             what was measured, on what, with what
//  "no_baseline",                                             see verdict.h
//  "panels": [{"title", "file_name", "words",                 runs of the same images, in the order they came
//    "verdict",                                                see verdict.h
//    "rows": [{"name", "method": "detail" or the policy, "baseline": bool, "ms": {mean, median, p95, p99, max},
//              "repeats": {count, min, max} of the median or null, "device_ms", "decode_ms", "speedup",
//              "in_noise": bool, the repeats overlap those of the baseline,
//              "scored": bool, the next mean something: "pooled", "p1", "min", "max_error", "temporal_max", "ssim", "flip",
//              "fovea": {"inside" | "outside": {"pooled", "min", "flip"} or null} or null, "decoded", "hit_rate",
//              "cache_bytes", "peak_bytes", "frames": {"first_scored", "every_scored", "listed", "wall", "psnr",
//              "temporal", "decoded"},
//              "hue": of the method, "shade": 0..1, "dash"}],    one configuration looks the same on the whole page
//    "views": {"min" | "pooled": {"front": [row, ...], "shown": [row, ...]}}}]}
// Decibels are null where images are equal and kBrokenPsnr where one is not finite, which keeps a run off the front;
// other values are null where there are none. `speedup` is against the row
// with policy none and detail 0, of the same tier, threads and memory bound of the panel ("baseline"), null where there is none.
// `front` is the Pareto front of median time against that accuracy, fastest first; `shown` are the rows that get a
// colour and a line, fastest first: all of a few rows, else baselines, front, and the best of methods not among them.
// Numbers have five digits. Rows must not be empty.
nlohmann::ordered_json chartModel(const std::vector<ChartRun>& rows);

constexpr size_t kMaxShown = 8; // more lines than that nobody tells apart

} // namespace gsc
