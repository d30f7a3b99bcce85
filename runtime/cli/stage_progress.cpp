// SPDX-License-Identifier: Apache-2.0
#include "runtime/cli/stage_progress.h"

#include "runtime/cli/reporter.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string_view>
#include <sys/ioctl.h>
#include <unistd.h>

namespace gsc {

namespace {

constexpr uint64_t kBarCells = 20;
constexpr double kRedrawSeconds = 0.1;
constexpr double kPlainSeconds = 1;   // a stage that takes less time gets no line in a log
constexpr double kSilentSeconds = 60; // a log gets a line at least as often
constexpr double kSurePart = 0.02;    // part of a stage, and seconds, after which its rate is known
constexpr double kSureSeconds = 1;

double secondsBetween(std::chrono::steady_clock::time_point from, std::chrono::steady_clock::time_point to)
{
    return std::chrono::duration<double>(to - from).count();
}

// Columns of the terminal that stderr is; no limit if it is none.
size_t terminalColumns()
{
    winsize size{};
    return ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : std::string::npos;
}

} // namespace

std::string roughTime(double seconds)
{
    if (seconds < 99.5)
        return formatString("%.0f s", seconds);
    const auto minutes = static_cast<unsigned long long>(std::llround(seconds / 60));
    return minutes < 100 ? formatString("%llu min", minutes)
                         : formatString("%llu h %02llu min", minutes / 60, minutes % 60);
}

StageProgress::StageProgress(ProgressMode mode) : m_mode(mode), m_start(Clock::now())
{
    if (m_mode == ProgressMode::Auto)
        m_mode = isatty(STDERR_FILENO) ? ProgressMode::Bar : ProgressMode::Plain;
}

double StageProgress::seconds() const
{
    return secondsBetween(m_start, Clock::now());
}

// Rate since the stage began: steps that were done before, by a command that was stopped, took none of this time.
double StageProgress::secondsLeft() const
{
    const double elapsed = secondsBetween(m_stage_start, Clock::now());
    if (m_finished <= m_first || m_finished >= m_total || elapsed < kSureSeconds)
        return -1;
    const double part = double(m_finished - m_first) / double(m_total - m_first);
    return part > kSurePart ? elapsed / part - elapsed : -1;
}

void StageProgress::update(const char* stage, uint64_t finished, uint64_t total)
{
    if (m_mode == ProgressMode::None)
        return;
    const bool is_new = m_stage != stage;
    const auto now = Clock::now();
    if (is_new) {
        close(false);
        m_stage = stage;
        m_stage_start = now;
        m_last_draw = m_mode == ProgressMode::Bar ? Clock::time_point{} : m_stage_start;
        m_first = finished;
        m_tenth = 0;
    }
    m_finished = finished;
    m_total = total;
    if (is_new && m_mode == ProgressMode::Json)
        printEvent("start");
    const double silent = secondsBetween(m_last_draw, now);
    if (m_mode == ProgressMode::Bar) {
        if (silent >= kRedrawSeconds) {
            m_last_draw = now;
            drawBar("");
        }
        return;
    }
    const uint64_t tenth = total ? uint64_t(10.0 * double(finished) / double(total)) : 0;
    const bool is_due = silent >= kSilentSeconds || (tenth > m_tenth && tenth < 10); // the end has a line of its own
    if (!is_due)
        return;
    m_tenth = tenth;
    if (m_mode == ProgressMode::Plain && silent < kPlainSeconds)
        return;
    m_last_draw = now;
    if (m_mode == ProgressMode::Json) {
        printEvent("progress");
        return;
    }
    std::string line = shownStage();
    if (total > 0)
        line += formatString(": %.0f %%", std::floor(100 * std::min(1.0, double(finished) / double(total))));
    if (const double left = secondsLeft(); left >= 0)
        line += ", " + roughTime(left) + " left";
    std::fprintf(stderr, "%s\n", line.c_str());
}

void StageProgress::close(bool failed)
{
    if (m_stage.empty())
        return;
    if (!failed)
        m_part.clear(); // the whole stage is done, not its last part alone
    const double elapsed = secondsBetween(m_stage_start, Clock::now());
    if (m_mode == ProgressMode::Bar) {
        drawBar(failed ? formatString("  failed in %.1f s\n", elapsed) : "  done\n");
        m_bar_width = 0;
    } else if (m_mode == ProgressMode::Plain)
        std::fprintf(stderr, "%s: %s in %.1f s\n", shownStage().c_str(), failed ? "failed" : "done", elapsed);
    else if (m_mode == ProgressMode::Json)
        printEvent(failed ? "failed" : "done");
    m_stage.clear();
}

void StageProgress::clearBar()
{
    if (m_bar_width == 0)
        return;
    std::fprintf(stderr, "\r%*s\r", int(m_bar_width), "");
    m_bar_width = 0;
    m_last_draw = {}; // drawn again with the next step
}

void StageProgress::drawBar(const std::string& end)
{
    const double elapsed = secondsBetween(m_stage_start, Clock::now()), left = end.empty() ? secondsLeft() : -1;
    const double part = m_total ? std::min(1.0, double(m_finished) / double(m_total)) : 0.0;
    const size_t filled = size_t(part * double(kBarCells));
    std::string bar = " [" + std::string(filled, '#') + std::string(kBarCells - filled, '.') + "] " +
                      formatString("%3.0f %%  %.1f s", 100 * part, elapsed);
    if (left >= 0)
        bar += "  " + roughTime(left) + " left";
    // a line that the terminal breaks cannot be drawn over
    const size_t room = terminalColumns() - end.size() - 1;
    std::string line = (shownStage().size() + bar.size() <= room ? shownStage() : m_stage) + bar;
    if (const std::string peak = "  [peak " + formatBytes(peakMemoryBytes()) + "]"; line.size() + peak.size() <= room)
        line += peak;
    const size_t width = line.size();
    if (width < m_bar_width) // spaces wipe out the end of a longer line before
        line.append(m_bar_width - width, ' ');
    m_bar_width = width;
    std::fprintf(stderr, "\r%s%s", line.c_str(), end.c_str());
    std::fflush(stderr);
}

void StageProgress::printEvent(const char* event) const
{
    nlohmann::ordered_json json = {
        {"event", event},
        {"stage", m_stage},
        {"done", m_finished},
        {"total", m_total},
        {"elapsedMs", uint64_t(1000 * secondsBetween(m_stage_start, Clock::now()))},
    };
    if (const double left = secondsLeft(); left >= 0 && std::string_view(event) == "progress")
        json["leftMs"] = uint64_t(1000 * left);
    std::fprintf(stderr, "%s\n", json.dump().c_str());
}

} // namespace gsc
