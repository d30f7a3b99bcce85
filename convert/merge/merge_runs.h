// SPDX-License-Identifier: Apache-2.0
// The rows that the shards of a run wrote, joined to what the run would have written in one piece.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace gsc {

struct MergedRuns {
    std::string schema; // of the rows
    std::string text;   // lines in the order of the tasks
    uint64_t shards = 0, tasks = 0, rows = 0;
    uint64_t exceeded = 0;            // of the rows of stability: how many exceed a bound
    std::vector<uint64_t> missing;    // tasks, from 0
    std::vector<std::string> devices; // that the rows name
};

class RunMerger {
public:
    // The lines of one file. Throws Error: InvalidFile for a line that is no row of a shard, is of another run than the
    // rows before, or of a task that had a row; Unsupported for rows of another version or form; Interrupted.
    void add(std::string_view text, const std::string& path);

    // Throws Error(InvalidFile) where there is no row, or not one of every task unless that is allowed.
    [[nodiscard]] MergedRuns finish(bool allow_missing) const;

private:
    struct Row {
        std::string where, line; // without its shard
        std::string device, id;  // id: of a run of a sweep
        uint64_t shard = 0;
        bool exceeds = false; // a bound of stability
    };
    void addLine(std::string_view line, const std::string& where, bool has_end);

    std::string m_schema, m_model, m_set, m_first; // of the first row, and where it stands
    uint64_t m_count = 0, m_tasks = 0;
    std::map<uint64_t, Row> m_rows; // by task
};

} // namespace gsc
