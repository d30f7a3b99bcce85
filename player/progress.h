// SPDX-License-Identifier: Apache-2.0
// Progress, warnings and notes on standard error.
#pragma once

#include "player/play_options.h"

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

namespace gsc {

class PlayLog {
public:
    // Auto becomes Bar on a terminal and Plain elsewhere; `quiet` silences everything.
    PlayLog(ProgressStyle style, bool quiet, int verbose);
    ~PlayLog(); // ends an open bar's line

    PlayLog(const PlayLog&) = delete;
    PlayLog& operator=(const PlayLog&) = delete;

    void warning(const std::string& text);
    void note(const std::string& text); // shown with -v
    void tell(const std::string& text); // shown unless quiet
    void progress(uint64_t done, uint64_t total);
    void setPart(const std::string& text)
    {
        m_part = text;
    } // what a person reads beside the frames, such as "run 3/12"

    // Every warning so far, for the report; also those that `quiet` did not show.
    [[nodiscard]] const std::vector<std::string>& warnings() const { return m_warnings; }

    void endBar(); // before something else is printed on the terminal

private:
    ProgressStyle m_style;
    bool m_quiet, m_bar_open = false;
    int m_verbose;
    uint64_t m_last_tenth = 0;
    std::string m_part;
    std::chrono::steady_clock::time_point m_start = std::chrono::steady_clock::now();
    std::chrono::steady_clock::time_point m_last_draw{};
    std::vector<std::string> m_warnings;
};

} // namespace gsc
