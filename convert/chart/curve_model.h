// SPDX-License-Identifier: Apache-2.0
// Content of a page of curves, as data: page/curve_figures.js turns it into a figure and a table.
#pragma once

#include "convert/chart/rows/curve_set.h"

#include <nlohmann/json.hpp>

#include <vector>

namespace gsc {

// {"version": of gsc, "kind": "curve",
//  "facts": [[name, words], ...],
//  "panels": [{"title", "file_name", "words", "verdict": words,            one panel, with all curves
//    "curves": [{"name",                                                     the model's, with the device if they differ
//      "points": [{"target": dB, null: the model itself; "anchors", "archive": bytes, "per_anchor": bytes of the
//                  archive per anchor of the model, "file", "resident", "frame", "decode": ms, "detail": [ms of each of
//                  kTimedDetails], "poses",
//                  "psnr", "worst_psnr", "worst": pose, "ssim", "worst_ssim", "flip", "worst_flip"}]}]}]}
// Decibels are null if pictures are equal. Numbers have five digits. Curves must not be empty.
nlohmann::ordered_json curveModel(const std::vector<ChartCurve>& curves);

} // namespace gsc
