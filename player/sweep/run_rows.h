// SPDX-License-Identifier: Apache-2.0
// The file that a sweep adds rows to (schemas/run.schema.json), one per line, possibly with a half-written last one.
#pragma once

#include "runtime/records/row_file.h"
#include "runtime/records/run_row.h"

#include <cstdint>
#include <map>
#include <set>
#include <string>

namespace gsc {

// Rows of a file, by config.id. Functions throw as those of RowFile.
class RunRows {
public:
    RunRows(const std::string& path, bool is_sharded);

    [[nodiscard]] const std::string& cutOff() const { return m_file.cutOff(); }
    [[nodiscard]] const RunRow* find(const std::string& id) const;
    [[nodiscard]] const std::map<std::string, RunRow>& all() const { return m_rows; }

    [[nodiscard]] bool hasTask(uint64_t task) const
    {
        return m_tasks.contains(task);
    } // true if a shard wrote a row of it

    void append(const RunRow& row);

private:
    std::map<std::string, RunRow> m_rows;
    std::set<uint64_t> m_tasks;
    RowFile m_file;
};

} // namespace gsc
