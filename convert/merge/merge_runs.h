// SPDX-License-Identifier: Apache-2.0
// Joins the rows of all shards of a run, as the run would have written them without shards.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace gsc {

// Joined rows, and facts about them.
struct MergedRuns {
    std::string schema; // schema of the rows
    std::string text;   // lines in the order of the tasks
    uint64_t shards = 0, tasks = 0, rows = 0;
    uint64_t exceeded = 0;            // rows of gsc-play stability that exceed a bound
    std::vector<uint64_t> missing;    // tasks without a row, from 0
    std::vector<std::string> devices; // different devices in the rows
};

// Collects the rows of all files of one run.
class RunMerger {
public:
    // Adds the lines of a file. Throws Error: InvalidFile for a line that is no row of a shard, is of another run than the
    // rows before, or of a task that has a row; Unsupported for rows of another version or schema; Interrupted.
    void add(std::string_view text, const std::string& path);

    // Joins the rows. Throws Error(InvalidFile) if there is no row, or if a task has none, unless `allow_missing`.
    [[nodiscard]] MergedRuns finish(bool allow_missing) const;

private:
    struct Row {
        std::string where, line; // line: without the field "shard"
        std::string device, id;  // id: only of a run of a sweep
        uint64_t shard = 0;
        bool exceeds = false; // true if a bound of gsc-play stability is exceeded
    };
    void addLine(std::string_view line, const std::string& where, bool has_end);

    std::string m_schema, m_form, m_model, m_set, m_first; // facts of the first row, and its file and line
    uint64_t m_count = 0, m_tasks = 0;
    std::map<uint64_t, Row> m_rows; // rows by task
};

} // namespace gsc
