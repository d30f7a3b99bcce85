// SPDX-License-Identifier: Apache-2.0
// The runs of several files: rows of gsc-play bench, with and without --sweep, and of gsc-play stability.
#pragma once

#include "convert/chart/rows/curve_set.h"

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace gsc {

// A run, measured once or several times. Then `accuracy` is the worst of all.
struct ChartRun : RunRow {
    uint64_t rounds = 1;              // repeats
    double least_ms = 0, most_ms = 0; // least and largest median frame time of a repeat
};

// Runs and curves of all input files.
struct RunSet {
    std::vector<ChartRun> rows;     // in the order of files and lines, a repeated run in the place of its first row
    std::vector<std::string> notes; // lines that were left out, in words
    std::vector<ChartCurve> curves; // rows with the part "curve", which are no runs
    uint64_t skipped = 0;           // lines of another form
    uint64_t repeats = 0;           // lines that measure a run of `rows` once more
    uint64_t duplicates = 0;        // copies of a line of another file
};

// Adds the lines of `text`; `path` names it in messages and notes. Throws Error: InvalidFile, Unsupported (rows of
// another version), Interrupted.
void addRuns(std::string_view text, const std::string& path, RunSet& runs);
// Joins the rows of one run (equal model, backend, device, sources, label and configuration) to one: the row in the middle
// by median frame time, with the least and largest time and the worst accuracy of all. If two are in the middle, the slower
// is taken, with the means of their medians. Repeats come from different files, because a sweep does no run again that its
// file has. To be called once, after the last file.
void foldRepeats(RunSet& runs);

} // namespace gsc
