// SPDX-License-Identifier: Apache-2.0
// The file that a sweep writes: rows of schemas/run.schema.json, one per line, and what a killed run left of it.
#pragma once

#include "runtime/records/row_file.h"
#include "runtime/records/run_row.h"

#include <cstdint>
#include <map>
#include <set>
#include <string>

namespace gsc {

// Rows that a file already has, by config.id. Throws as RowFile.
class RunRows {
public:
    explicit RunRows(const std::string& path);

    [[nodiscard]] const std::string& cutOff() const { return m_file.cutOff(); }
    [[nodiscard]] const RunRow* find(const std::string& id) const;
    [[nodiscard]] const std::map<std::string, RunRow>& all() const { return m_rows; }

    [[nodiscard]] bool hasTask(uint64_t task) const { return m_tasks.contains(task); } // is there a shard's row of it?

    void append(const RunRow& row);

private:
    std::map<std::string, RunRow> m_rows;
    std::set<uint64_t> m_tasks;
    RowFile m_file;
};

} // namespace gsc
