// SPDX-License-Identifier: Apache-2.0
// Shows the progress of long commands on stderr: a bar on a terminal, lines in a log, NDJSON for a program.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

namespace gsc {

enum class ProgressMode { Auto, Bar, Plain, Json, None };

class StageProgress {
public:
    explicit StageProgress(ProgressMode mode); // Auto means Bar if stderr is a terminal, else Plain

    // Reports that `finished` of `total` steps of a stage are done; total = 0: not known. A new `stage` ends the one
    // before. May be called often: it prints at most ten times a second (bar), at each tenth (JSON), or at each tenth
    // but at most once a second (plain).
    void update(const char* stage, uint64_t finished, uint64_t total);
    void close(bool failed);
    void setPart(const std::string& part) { m_part = part; }
    void breakLine(); // call before something else is printed to stderr; the stage goes on

    [[nodiscard]] double seconds() const; // seconds since the StageProgress was made

private:
    using Clock = std::chrono::steady_clock;

    [[nodiscard]] std::string shownStage() const { return m_part.empty() ? m_stage : m_stage + ", " + m_part; }
    void drawBar(uint64_t finished, uint64_t total);
    void printEvent(const char* event, uint64_t finished, uint64_t total) const;

    ProgressMode m_mode;
    Clock::time_point m_start;
    Clock::time_point m_stage_start;
    Clock::time_point m_last_draw;
    std::string m_stage; // name of the current stage; empty = none
    std::string m_part;
    uint64_t m_finished = 0, m_total = 0;
    uint64_t m_tenth = 0; // tenth of the stage that was printed last
    size_t m_bar_width = 0;
};

} // namespace gsc
