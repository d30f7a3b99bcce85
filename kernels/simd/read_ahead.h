// SPDX-License-Identifier: Apache-2.0
// Prefetches memory that a later stage reads, line by line while the present stage computes. To read it only when it is
// needed, or to prefetch it all at once, would wait for the dozen or so lines that a core can have under way.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

namespace gsc {

class ReadAhead {
public:
    // Adds a range of memory to be prefetched. Ranges for which there is no room are left to the hardware.
    void add(const void* from, size_t bytes)
    {
        if (bytes == 0 || m_count == kMost)
            return;
        const auto at = reinterpret_cast<uintptr_t>(from);
        const uintptr_t first = at / kLine, end = (at + bytes - 1) / kLine + 1;
        m_ranges[m_count++] = {first, end};
        m_lines += size_t(end - first);
    }

    [[nodiscard]] size_t lines() const { return m_lines; }

    // Prefetches the next `lines` cache lines, or as many as are left, into the second-level cache; the first-level
    // cache keeps the data of the present stage.
    void ask(size_t lines)
    {
        lines = std::min(lines, m_lines);
        m_lines -= lines;
        while (lines > 0) {
            Range& range = m_ranges[m_next];
            const size_t now = std::min<size_t>(lines, range.end - range.first);
            for (const uintptr_t end = range.first + now; range.first < end; ++range.first)
                __builtin_prefetch(reinterpret_cast<const void*>(range.first * kLine), 0, 2);
            lines -= now;
            m_next += range.first == range.end;
        }
        if (m_lines == 0)
            m_count = m_next = 0;
    }

private:
    static constexpr size_t kLine = 64;
    static constexpr uint32_t kMost = 64;
    struct Range {
        uintptr_t first, end; // range of cache lines
    };
    Range m_ranges[kMost];
    size_t m_lines = 0;
    uint32_t m_count = 0, m_next = 0;
};

} // namespace gsc
