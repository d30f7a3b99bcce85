// SPDX-License-Identifier: Apache-2.0
// The runs of several files.
#pragma once

#include "runtime/records/run_row.h"

#include <cstdint>
#include <optional>
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
    uint64_t skipped = 0;           // lines of another form
    uint64_t repeats = 0;           // lines that measure a run of `rows` once more
    uint64_t duplicates = 0;        // lines that tell a measurement told before
};

// `where` names the line in messages, such as "runs.jsonl:12". Returns the run, or nothing for a line of another known
// form (gsc.bench/1), whose schema then is in `other`. Throws Error: InvalidFile (no JSON, a field missing or wrong),
// Unsupported (a newer gsc.run).
std::optional<ChartRun> parseRunLine(std::string_view line, const std::string& where, std::string& other);

// Adds the lines of `text`; `path` names it in messages and notes. Throws Error(InvalidFile, Unsupported, Interrupted).
void addRuns(std::string_view text, const std::string& path, RunSet& runs);
// Makes one row of those that measure the same run (same model, backend, device, sources, label and configuration): the
// one in the middle by median frame time, with the spread of all and the worst accuracy of all. An even number has two
// in the middle: the slower is taken, with the means of their medians. A sweep never runs again what its file has, so
// repeats come from files of their own. To be called once, after the last file.
void foldRepeats(RunSet& runs);

} // namespace gsc
