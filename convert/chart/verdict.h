// SPDX-License-Identifier: Apache-2.0
// A comparison's outcome in words.
#pragma once

#include "convert/chart/rows/run_set.h"

#include <nlohmann/json.hpp>

#include <string>
#include <vector>

namespace gsc {

// {"floors": [{"psnr": 50, "row": index or null}, ...],    the fastest run whose worst frame has that many dB
//  "sentences": [{"run": name or "", "text", "options"}, ...]}    read one after the other, a sentence starts with `run`;
//                                                                  `options`: of gsc-play, that draw so, "" without a run
// `rows` are those of the model (chart_model.h), one for each of `runs`.
nlohmann::ordered_json verdictJson(const std::vector<const ChartRun*>& runs, const nlohmann::ordered_json& rows);
// Names the model's panels without a speed-up, and why; empty where all have one.
std::string baselineWords(const nlohmann::ordered_json& panels);

} // namespace gsc
