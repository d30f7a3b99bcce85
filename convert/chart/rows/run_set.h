// SPDX-License-Identifier: Apache-2.0
// The runs of several files: rows of gsc-play bench, with and without --sweep, and of gsc-play stability.
#pragma once

#include "convert/chart/rows/curve_set.h"

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace gsc {

struct ChartRun : RunRow {
    // How often the run was measured, and its median frame time in those repeats, from the least to the most. With
    // more than one, `accuracy` is the worst of all.
    uint64_t rounds = 1;
    double least_ms = 0, most_ms = 0;
};

struct RunSet {
    std::vector<ChartRun> rows;     // in the order of files and lines, a repeated run where it came first
    std::vector<std::string> notes; // lines that were left out, in words
    std::vector<ChartCurve> curves; // of rows that have the part "curve", which are no runs
    uint64_t skipped = 0;           // lines of another form
    uint64_t repeats = 0;           // lines that measure a run of `rows` once more
    uint64_t duplicates = 0;        // lines that tell a measurement told before
};

// Adds the lines of `text`; `path` names it in messages and notes. Throws Error: InvalidFile, Unsupported (rows of
// another version), Interrupted.
void addRuns(std::string_view text, const std::string& path, RunSet& runs);
// Makes one row of those that measure the same run (same model, backend, device, sources, label and configuration): the
// one in the middle by median frame time, with the spread of all and the worst accuracy of all. An even number has two
// in the middle: the slower is taken, with the means of their medians. A sweep never runs again what its file has, so
// repeats come from files of their own. To be called once, after the last file.
void foldRepeats(RunSet& runs);

} // namespace gsc
