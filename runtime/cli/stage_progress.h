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
    // before. May be called often: it prints at most ten times a second (bar), or at each tenth and each minute (JSON, and
    // plain but at most once a second).
    void update(const char* stage, uint64_t finished, uint64_t total);
    void close(bool failed);
    void setPart(const std::string& part) { m_part = part; }
    void clearBar(); // call before something else is printed to the terminal; the stage goes on

    [[nodiscard]] double seconds() const; // seconds since the StageProgress was made

private:
    using Clock = std::chrono::steady_clock;

    [[nodiscard]] std::string shownStage() const { return m_part.empty() ? m_stage : m_stage + ", " + m_part; }
    [[nodiscard]] double secondsLeft() const; // time until the stage ends; negative: not known
    void drawBar(const std::string& end);
    void printEvent(const char* event) const;

    ProgressMode m_mode;
    Clock::time_point m_start;
    Clock::time_point m_stage_start;
    Clock::time_point m_last_draw;
    std::string m_stage; // name of the current stage; empty = none
    std::string m_part;
    uint64_t m_first = 0, m_finished = 0, m_total = 0; // steps; m_first: those done when the stage began
    uint64_t m_tenth = 0;                              // tenth of the stage that was printed last
    size_t m_bar_width = 0;
};

// Time in words: "40 s", "12 min", "3 h 20 min".
std::string roughTime(double seconds);

} // namespace gsc
