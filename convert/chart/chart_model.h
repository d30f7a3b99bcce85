// SPDX-License-Identifier: Apache-2.0
// Content of a page, as data: page/figures.js turns it into figures, page/report.js into text and tables.
#pragma once

#include "convert/chart/rows/run_set.h"

#include <nlohmann/json.hpp>

#include <string>

namespace gsc {

// {"version": of gsc,
//  "facts": [[name, words], ...],                             model, device and program
//  "no_baseline",                                             see verdict.h
//  "panels": [{"title", "file_name", "words",                 runs that draw one set of poses, in the order of the input
//    "verdict",                                                see verdict.h
//    "rows": [{"name", "method": "detail" or the policy, "baseline": bool, "ms": {mean, median, p95, p99, max},
//              "repeats": {count, min, max} of the median or null, "device_ms", "decode_ms", "speedup",
//              "in_noise": bool, the repeats overlap those of the baseline,
//              "scored": bool, false: the next have no meaning: "pooled", "p1", "min", "max_error", "temporal_max", "ssim", "flip",
//              "fovea": {"inside" | "outside": {"pooled", "min", "flip"} or null} or null, "decoded", "hit_rate",
//              "cache_bytes", "peak_bytes", "frames": {"first_scored", "every_scored", "listed", "wall", "psnr",
//              "temporal", "decoded"},
//              "hue": number of the method, "shade": 0..1, "dash"}],    equal on the whole page for equal settings
//    "views": {"min" | "pooled": {"front": [row, ...], "shown": [row, ...]}}}]}
// Decibels are null if images are equal, and kBrokenPsnr if one is not finite, which keeps a run off the front; other
// values are null if they are not known. `speedup`: median time of the baseline over that of the row, null without a
// baseline: the row of the panel with policy none, detail 0, and the tier, threads and memory bound of the row.
// `front` is the Pareto front of median time and the accuracy of the view, fastest first; `shown` are the rows that get a
// colour and a line, fastest first: all if they are few, else baselines, front, and the best of every other method.
// Numbers have five digits. Rows must not be empty.
nlohmann::ordered_json chartModel(const std::vector<ChartRun>& rows);

constexpr size_t kMaxShown = 8; // most lines that a reader can tell apart

} // namespace gsc
