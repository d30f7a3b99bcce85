// SPDX-License-Identifier: Apache-2.0
#include "player/progress.h"

#include "format/error.h"

#include <algorithm>
#include <cstdio>

#include <unistd.h>

namespace gsc {

PlayLog::PlayLog(ProgressStyle style, bool quiet, int verbose) : m_style(style), m_quiet(quiet), m_verbose(verbose)
{
    if (m_style == ProgressStyle::Auto)
        m_style = isatty(STDERR_FILENO) ? ProgressStyle::Bar : ProgressStyle::Plain;
}

PlayLog::~PlayLog()
{
    endBar();
}

void PlayLog::endBar()
{
    if (m_bar_open)
        std::fputc('\n', stderr);
    m_bar_open = false;
}

void PlayLog::warning(const std::string& text)
{
    m_warnings.push_back(text);
    if (m_quiet)
        return;
    endBar();
    std::fprintf(stderr, "warning: %s\n", validUtf8(text).c_str());
}

void PlayLog::note(const std::string& text)
{
    if (m_verbose >= 1)
        tell(text);
}

void PlayLog::tell(const std::string& text)
{
    if (m_quiet)
        return;
    endBar();
    std::fprintf(stderr, "%s\n", validUtf8(text).c_str());
}

void PlayLog::progress(uint64_t done, uint64_t total)
{
    if (m_quiet || m_style == ProgressStyle::None || total == 0)
        return;
    using Clock = std::chrono::steady_clock;
    const auto now = Clock::now();
    const double seconds = std::chrono::duration<double>(now - m_start).count();
    const auto shown_done = static_cast<unsigned long long>(done), shown_total = static_cast<unsigned long long>(total);
    if (m_style == ProgressStyle::Bar) {
        if (done < total && now - m_last_draw < std::chrono::milliseconds(100))
            return;
        m_last_draw = now;
        constexpr uint64_t kCells = 20;
        std::string bar(kCells, '.');
        std::fill_n(bar.begin(), kCells * done / total, '#');
        const double left = done > 0 ? seconds * double(total - done) / double(done) : 0;
        std::fprintf(stderr, "\r[%s] %llu/%llu frames%s%s  %.1f s  ETA %.0f s \033[K", bar.c_str(), shown_done,
                     shown_total, m_part.empty() ? "" : ", ", m_part.c_str(), seconds, left);
        std::fflush(stderr);
        m_bar_open = done < total;
        if (done == total)
            std::fputc('\n', stderr);
        return;
    }
    // a step of ten per cent at least, so that a log stays short
    const uint64_t tenth = 10 * done / total;
    if (done < total && tenth == m_last_tenth)
        return;
    m_last_tenth = tenth;
    if (m_style == ProgressStyle::Json)
        std::fprintf(stderr,
                     "{\"event\":\"progress\",\"stage\":\"render\",\"done\":%llu,\"total\":%llu,"
                     "\"elapsedMs\":%.0f}\n",
                     shown_done, shown_total, seconds * 1000);
    else
        std::fprintf(stderr, "render %llu/%llu frames%s%s, %.1f s\n", shown_done, shown_total,
                     m_part.empty() ? "" : ", ", m_part.c_str(), seconds);
}

} // namespace gsc
