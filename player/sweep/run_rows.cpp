// SPDX-License-Identifier: Apache-2.0
#include "player/sweep/run_rows.h"

#include <gsc/error.h>
#include "player/measure/row_output.h"
#include "runtime/records/row_lines.h"

namespace gsc {

RunRows::RunRows(const std::string& path, bool is_sharded)
    : m_file(path, kRunRow, [&](const OrderedJson& json, const std::string& where) {
          RunRow row = runRowOf(json, where);
          if (row.curve || row.stability || (row.shard && !is_sharded))
              refuseMixed(where, row);
          if (row.shard)
              m_tasks.insert(row.shard->task);
          m_rows.insert_or_assign(row.config.id, std::move(row));
      })
{
}

const RunRow* RunRows::find(const std::string& id) const
{
    const auto found = m_rows.find(id);
    return found == m_rows.end() ? nullptr : &found->second;
}

void RunRows::append(const RunRow& row)
{
    m_file.add(jsonText(toJson(row), -1));
    if (row.shard)
        m_tasks.insert(row.shard->task);
    m_rows.insert_or_assign(row.config.id, row);
}

} // namespace gsc
