// SPDX-License-Identifier: Apache-2.0
// The runs of several files.
#pragma once

#include "convert/chart/run_row.h"

namespace gsc {

struct RunSet {
    std::vector<RunRow> rows;       // in the order of files and lines, a repeated run where it came first
    std::vector<std::string> notes; // lines that were left out, in words
    uint64_t skipped = 0;           // lines of another form
    uint64_t repeats = 0;           // lines that measure a run of `rows` once more
    uint64_t duplicates = 0;        // lines that tell a measurement told before
};

// Adds the lines of `text`; `path` names it in messages and notes. Throws Error(InvalidFile, Unsupported, Interrupted).
void addRuns(std::string_view text, const std::string& path, RunSet& runs);
// Makes one row of those that measure the same run (same model, backend, device, sources, label and configuration): the
// one in the middle by median frame time, with the spread of all and the worst accuracy of all. Of two in the middle it
// is the slower, with the means of their medians. A sweep never runs again what its file has, so repeats come from files
// of their own. To be called once, after the last file.
void foldRepeats(RunSet& runs);

} // namespace gsc
