// SPDX-License-Identifier: Apache-2.0
#include "player/sweep/run_rows.h"

#include <gsc/error.h>
#include "runtime/records/row_file.h"

namespace gsc {

namespace {

const RowKind kRunRow{R"({"schema":"gsc.run/1",)", "a sweep",
                      "\"gsc.run/1\" (schemas/run.schema.json) with the numbers of this version"};

} // namespace

RunRows::RunRows(const std::string& path, std::string& cut_off) : m_path(path)
{
    const RowFile file = readRows(path, kRunRow, [&](const OrderedJson& json) {
        try {
            RunRow row;
            describe(Record(json, path), row);
            if (row.shard)
                m_tasks.insert(row.shard->task);
            m_rows.insert_or_assign(row.config.id, std::move(row));
            return true;
        } catch (const Error&) {
            return false;
        }
    });
    cut_off = file.cut_off;
    m_bytes = file.bytes;
    m_whole = file.whole + (file.needs_end ? 1 : 0); // which comes with the next row
}

const RunRow* RunRows::find(const std::string& id) const
{
    const auto found = m_rows.find(id);
    return found == m_rows.end() ? nullptr : &found->second;
}

void RunRows::append(const RunRow& row)
{
    if (!m_path.empty()) {
        const std::string line = jsonText(toJson(row), -1);
        checkUntouched(m_path, m_bytes, kRunRow);
        addRow(m_path, kRunRow, line);
        m_whole += line.size() + 1;
        m_bytes = m_whole;
    }
    if (row.shard)
        m_tasks.insert(row.shard->task);
    m_rows.insert_or_assign(row.config.id, row);
}

} // namespace gsc
