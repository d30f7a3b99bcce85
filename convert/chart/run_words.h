// SPDX-License-Identifier: Apache-2.0
// Runs in words: what they have in common is said once, what tells them apart names them.
#pragma once

#include "convert/chart/rows/run_set.h"

namespace gsc {

// The word that tells runs apart most: "detail", or the policy of reuse.
std::string methodOf(const RowConfig& config);
// The model whose exact pictures the run was held against, its own but for one that was baked.
const FileFacts& comparedWith(const ChartRun& row);
// Words for what was drawn, where and how, the trajectory first; an entry without anything to say is empty. Rows that
// agree in all of them are compared with each other.
std::vector<std::string> sceneWords(const ChartRun& row);
// Words for what the run tries: reuse, tier, switches, budgets, another file. First the policy, never empty.
std::vector<std::string> configWords(const ChartRun& row);

// Options of gsc-play by which a frame is drawn as in the run, such as "--tier fast --detail 2"; cameras, size and device
// are left to whoever types them. Each is one that its program takes with the others.
std::string optionsToType(const RowConfig& config);

// Splits one list of words per row into those all rows share and the rest, joined by ", ". The first word always stays
// in `own`. Names that come out equal get " (2)", " (3)".
struct RunNames {
    std::string common;
    std::vector<std::string> own; // one per row
};
RunNames nameRuns(const std::vector<std::vector<std::string>>& words);

// "gsc-play 0.1.0 (0a1b2c3)"
std::string toolWords(const ChartRun& row);
// "town walk/2" -> "town-walk-2", at most 60 characters, "run" if nothing is left.
std::string fileNameOf(const std::string& title);

} // namespace gsc
