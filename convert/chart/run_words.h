// SPDX-License-Identifier: Apache-2.0
// Words for runs: settings that all share are stated once, settings that differ make the names.
#pragma once

#include "convert/chart/rows/run_set.h"

namespace gsc {

// Method of a run: "detail", or the policy of reuse.
std::string methodOf(const RowConfig& config);
// Model whose exact pictures the run was compared with: its own, except for a baked model.
const FileFacts& comparedWith(const ChartRun& row);
// Words for trajectory, model, device and size of the pictures, the trajectory first; some may be empty. Rows with equal
// words are compared with each other.
std::vector<std::string> sceneWords(const ChartRun& row);
// Words for the settings that are compared: policy of reuse, budgets, tier, other options, another file. The policy comes
// first and is never empty; others may be.
std::vector<std::string> configWords(const ChartRun& row);

// Options of gsc-play that draw a frame as in the run, such as "--tier fast --detail 2", without cameras, size and device.
// gsc-play accepts them together.
std::string optionsToType(const RowConfig& config);

// Splits the words of every row into words that all rows share and the rest, joined by ", ". The first word always stays in
// `own`. Equal names get " (2)", " (3)".
struct RunNames {
    std::string common;
    std::vector<std::string> own; // one per row
};
RunNames nameRuns(const std::vector<std::vector<std::string>>& words);

// Program of a row, such as "gsc-play 0.1.0 (0a1b2c3)".
std::string toolWords(const ChartRun& row);
// Title as a file name: "town walk/2" -> "town-walk-2", at most 60 characters, "run" if nothing is left.
std::string fileNameOf(const std::string& title);

} // namespace gsc
