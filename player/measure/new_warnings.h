// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "runtime/cli/reporter.h"

#include <string>
#include <vector>

namespace gsc {

// Splits the warnings of a log among rows, so that a row has its own alone, whichever shard wrote it.
class NewWarnings {
public:
    explicit NewWarnings(const Reporter& log) : m_log(log), m_told(log.warnings().size()) {}

    // Appends the warnings since the last call, or since this object was made.
    void addTo(std::vector<std::string>& row)
    {
        const std::vector<std::string>& all = m_log.warnings();
        row.insert(row.end(), all.begin() + ptrdiff_t(m_told), all.end());
        m_told = all.size();
    }

private:
    const Reporter& m_log;
    size_t m_told;
};

} // namespace gsc
