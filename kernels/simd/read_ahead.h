// SPDX-License-Identifier: Apache-2.0
// Memory that a later stage reads, asked for line by line while this one computes: reading it when it is needed, or
// asking for all at once, waits for the dozen or so lines that a core can have under way.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

namespace gsc {

class ReadAhead {
public:
    // Ranges past the last that there is room for are left to the hardware.
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

    // Prefetches the next `lines` lines, or the rest, into the second cache level: the first has the stage's own data.
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
        uintptr_t first, end; // lines
    };
    Range m_ranges[kMost];
    size_t m_lines = 0;
    uint32_t m_count = 0, m_next = 0;
};

} // namespace gsc
