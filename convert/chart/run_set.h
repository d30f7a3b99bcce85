// SPDX-License-Identifier: Apache-2.0
// The runs of several files.
#pragma once

#include "convert/chart/run_row.h"

namespace gsc {

struct RunSet {
    std::vector<RunRow> rows;       // in the order of files and lines
    std::vector<std::string> notes; // lines that were left out, in words
    uint64_t skipped = 0;           // lines of another form
    uint64_t replaced = 0;          // lines of which a later one tells the same run
};

// Adds the lines of `text`; `path` names it in messages and notes. Throws Error(InvalidFile, Unsupported, Interrupted).
void addRuns(std::string_view text, const std::string& path, RunSet& runs);
// Leaves the last of the rows that tell the same run (same model, backend, device, sources, label and configuration):
// a sweep that was measured again. To be called once, after the last file.
void dropRepeatedRuns(RunSet& runs);

} // namespace gsc
