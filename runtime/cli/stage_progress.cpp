// SPDX-License-Identifier: Apache-2.0
#include "runtime/cli/stage_progress.h"

#include "runtime/cli/reporter.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdio>
#include <unistd.h>

namespace gsc {

namespace {

constexpr uint64_t kBarCells = 20;
constexpr double kRedrawSeconds = 0.1;
constexpr double kPlainSeconds = 1; // a stage that takes less time gets no line in a log

double secondsBetween(std::chrono::steady_clock::time_point from, std::chrono::steady_clock::time_point to)
{
    return std::chrono::duration<double>(to - from).count();
}

} // namespace

StageProgress::StageProgress(ProgressMode mode) : m_mode(mode), m_start(Clock::now())
{
    if (m_mode == ProgressMode::Auto)
        m_mode = isatty(STDERR_FILENO) ? ProgressMode::Bar : ProgressMode::Plain;
}

double StageProgress::seconds() const
{
    return secondsBetween(m_start, Clock::now());
}

void StageProgress::update(const char* stage, uint64_t finished, uint64_t total)
{
    if (m_mode == ProgressMode::None)
        return;
    if (m_stage != stage) {
        close(false);
        m_stage = stage;
        m_stage_start = Clock::now();
        m_last_draw = m_mode == ProgressMode::Plain ? m_stage_start : Clock::time_point{};
        m_tenth = 0;
        if (m_mode == ProgressMode::Json)
            printEvent("start", finished, total);
    }
    m_finished = finished;
    m_total = total;
    if (m_mode == ProgressMode::Bar) {
        const auto now = Clock::now();
        if (secondsBetween(m_last_draw, now) >= kRedrawSeconds) {
            m_last_draw = now;
            drawBar(finished, total);
        }
        return;
    }
    const uint64_t tenth = total ? uint64_t(10.0 * double(finished) / double(total)) : 0;
    if (tenth <= m_tenth || tenth >= 10) // the end of a stage is printed as a line of its own
        return;
    m_tenth = tenth;
    if (m_mode == ProgressMode::Json) {
        printEvent("progress", finished, total);
        return;
    }
    const auto now = Clock::now();
    if (secondsBetween(m_last_draw, now) < kPlainSeconds)
        return;
    m_last_draw = now;
    std::fprintf(stderr, "%s: %llu %%\n", shownStage().c_str(), static_cast<unsigned long long>(10 * tenth));
}

void StageProgress::close(bool failed)
{
    if (m_stage.empty())
        return;
    const double elapsed = secondsBetween(m_stage_start, Clock::now());
    if (m_mode == ProgressMode::Bar) {
        drawBar(m_finished, m_total);
        std::fprintf(stderr, failed ? "  failed in %.1f s\n" : "  done\n", elapsed);
        m_bar_width = 0;
    } else if (m_mode == ProgressMode::Plain)
        std::fprintf(stderr, "%s: %s in %.1f s\n", shownStage().c_str(), failed ? "failed" : "done", elapsed);
    else if (m_mode == ProgressMode::Json)
        printEvent(failed ? "failed" : "done", m_finished, m_total);
    m_stage.clear();
}

void StageProgress::breakLine()
{
    if (m_bar_width)
        std::fputc('\n', stderr);
    m_bar_width = 0;
}

void StageProgress::drawBar(uint64_t finished, uint64_t total)
{
    const double elapsed = secondsBetween(m_stage_start, Clock::now());
    const double part = total ? std::min(1.0, double(finished) / double(total)) : 0.0;
    const size_t filled = size_t(part * double(kBarCells));
    std::string line = shownStage() + " [" + std::string(filled, '#') + std::string(kBarCells - filled, '.') + "] " +
                       formatString("%3.0f %%  %.1f s", 100 * part, elapsed);
    if (part > 0.02 && part < 1.0 && elapsed > 1.0)
        line += formatString("  ETA %.0f s", elapsed / part - elapsed);
    line += "  [peak " + formatBytes(peakMemoryBytes()) + "]";
    const size_t width = line.size();
    if (width < m_bar_width) // spaces wipe out the end of a longer line before
        line.append(m_bar_width - width, ' ');
    m_bar_width = width;
    std::fprintf(stderr, "\r%s", line.c_str());
    std::fflush(stderr);
}

void StageProgress::printEvent(const char* event, uint64_t finished, uint64_t total) const
{
    const nlohmann::ordered_json json = {
        {"event", event},
        {"stage", m_stage},
        {"done", finished},
        {"total", total},
        {"elapsedMs", uint64_t(1000 * secondsBetween(m_stage_start, Clock::now()))},
    };
    std::fprintf(stderr, "%s\n", json.dump().c_str());
}

} // namespace gsc
