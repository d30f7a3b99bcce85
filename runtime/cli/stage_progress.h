// SPDX-License-Identifier: Apache-2.0
// Progress of long commands on stderr: a bar on a terminal, lines in a log, NDJSON for a program.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

namespace gsc {

enum class ProgressMode { Auto, Bar, Plain, Json, None };

class StageProgress {
public:
    explicit StageProgress(ProgressMode mode); // Auto: Bar if stderr is a terminal, else Plain

    // A new `stage` closes the one before it. `total` 0 = not known. May be called often: prints at most ten
    // times a second (bar), once per tenth (JSON), or once per tenth and second (plain).
    void update(const char* stage, uint64_t finished, uint64_t total);
    void close(bool failed);
    void setPart(const std::string& part) { m_part = part; }
    void breakLine(); // before something else is printed to stderr; the stage stays open

    [[nodiscard]] double seconds() const; // since construction

private:
    using Clock = std::chrono::steady_clock;

    [[nodiscard]] std::string shownStage() const { return m_part.empty() ? m_stage : m_stage + ", " + m_part; }
    void drawBar(uint64_t finished, uint64_t total);
    void printEvent(const char* event, uint64_t finished, uint64_t total) const;

    ProgressMode m_mode;
    Clock::time_point m_start;
    Clock::time_point m_stage_start;
    Clock::time_point m_last_draw;
    std::string m_stage; // empty = none open
    std::string m_part;
    uint64_t m_finished = 0, m_total = 0;
    uint64_t m_tenth = 0; // last tenth that was printed
    size_t m_bar_width = 0;
};

} // namespace gsc
