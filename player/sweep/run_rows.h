// SPDX-License-Identifier: Apache-2.0
// The file that a sweep writes: rows of schemas/run.schema.json, one per line, and what a killed run left of it.
#pragma once

#include "runtime/records/run_row.h"

#include <cstdint>
#include <map>
#include <set>
#include <string>

namespace gsc {

// Rows that a file already has, by config.id.
class RunRows {
public:
    // A half-written last line is what a killed run left behind; `cut_off` then says so and is empty otherwise. One that
    // lacks its end alone is a row. The file is not changed. A missing file has no rows. Throws Error: InvalidFile for a
    // line that is no row, so that no other file is added to; Io.
    explicit RunRows(const std::string& path, std::string& cut_off);

    [[nodiscard]] const RunRow* find(const std::string& id) const;
    [[nodiscard]] const std::map<std::string, RunRow>& all() const { return m_rows; }

    [[nodiscard]] bool hasTask(uint64_t task) const { return m_tasks.contains(task); } // is there a shard's row of it?

    // Adds a line behind the last whole one; where that fails the file has what it had. Throws Error(Io), also where the
    // file is not as it was left: two sweeps cannot share one.
    void append(const RunRow& row);

private:
    std::string m_path;
    uint64_t m_bytes = 0; // of the file, with what a killed run left
    uint64_t m_whole = 0; // of its whole lines, each with its end
    std::map<std::string, RunRow> m_rows;
    std::set<uint64_t> m_tasks;
};

} // namespace gsc
