// SPDX-License-Identifier: Apache-2.0
// Reads an AnchorSource to its end; the next batch is read while the last one is worked on.
#pragma once

#include "convert/input/checkpoint.h"

#include <cstdint>
#include <functional>
#include <span>

namespace gsc {

constexpr size_t kBatchRows = 8192; // anchors per batch

// Calls `work` with every batch, in order, one at a time, but not always from the calling thread. Throws what `source`
// or `work` throws, and Error(Interrupted).
void forEachBatch(AnchorSource& source, uint32_t fields, const std::function<void(const AnchorBatch&)>& work);

// Tells which rows the scan dropped. isDropped() must be called with ascending rows.
class DroppedRows {
public:
    explicit DroppedRows(std::span<const uint64_t> rows) : m_rows(rows) {}

    bool isDropped(uint64_t row)
    {
        if (m_next == m_rows.size() || m_rows[m_next] != row)
            return false;
        ++m_next;
        return true;
    }
    [[nodiscard]] uint64_t before() const { return m_next; } // number of dropped rows before the row asked for last

private:
    std::span<const uint64_t> m_rows;
    size_t m_next = 0;
};

} // namespace gsc
