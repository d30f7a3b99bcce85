// SPDX-License-Identifier: Apache-2.0
// Outcome of a comparison of runs, in words.
#pragma once

#include "convert/chart/rows/run_set.h"

#include <nlohmann/json.hpp>

#include <string>
#include <vector>

namespace gsc {

// {"floors": [{"psnr": 50, "row": index or null}, ...],    the fastest run whose worst frame has that many dB
//  "sentences": [{"run": name or "", "text", "options"}, ...]}    each reads `run`, then `text`;
//                                                                  `options`: options of gsc-play for `run`, or ""
// `rows`: rows of a panel of the model (chart_model.h), one for each of `runs`.
nlohmann::ordered_json verdictJson(const std::vector<const ChartRun*>& runs, const nlohmann::ordered_json& rows);
// Names the panels of a model without a speed-up, with the reason; empty if all have one.
std::string baselineWords(const nlohmann::ordered_json& panels);

} // namespace gsc
