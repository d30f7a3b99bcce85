// SPDX-License-Identifier: Apache-2.0
#include "player/xr/xr_log.h"

#include "format/error.h"
#include "format/file/output_paths.h"
#include "player/xr/place_file.h"

#include <cerrno>

namespace gsc {

namespace {

constexpr size_t kAges = 8; // that are counted one by one

} // namespace

// note: no temporary file, as elsewhere: whoever follows the session reads the lines while it runs
XrLog::XrLog(const std::string& path, bool overwrite) : m_path(path)
{
    if (path.empty())
        return;
    checkOutput(path, OutputKind::Binary, overwrite);
    m_file = std::fopen(path.c_str(), "w");
    if (m_file == nullptr)
        failOutput(path, "cannot be opened", errno);
}

XrLog::~XrLog()
{
    close();
}

void XrLog::close()
{
    if (m_file != nullptr)
        std::fclose(m_file);
    m_file = nullptr;
}

void XrLog::add(const XrFrame& frame)
{
    ++m_frames;
    m_visible += frame.visible;
    m_untracked += frame.visible && !frame.tracked;
    m_missed += frame.missed;
    m_pictures += frame.fresh;
    m_busy.push_back(frame.busy_ms);
    if (frame.shows > 0) {
        m_ages.push_back(double(frame.age));
        m_off.push_back(frame.off_ms);
    }
    if (frame.fresh)
        m_latency.push_back(frame.latency_ms);
    if (m_file == nullptr)
        return;
    const bool shows = frame.shows > 0;
    const OrderedJson line = {
        {"frame", frame.frame},
        {"display_time", frame.display_time},
        {"period_ms", frame.period_ms},
        {"missed", frame.missed},
        {"visible", frame.visible},
        {"tracked", frame.tracked},
        {"shows", frame.shows},
        {"fresh", frame.fresh},
        {"age", shows ? OrderedJson(frame.age) : OrderedJson()},
        {"off_ms", shows ? jsonNumber(frame.off_ms) : OrderedJson()},
        {"latency_ms", frame.fresh ? jsonNumber(frame.latency_ms) : OrderedJson()},
        {"draw_ms", frame.fresh ? jsonNumber(frame.draw_ms) : OrderedJson()},
        {"lod_bias", frame.fresh ? jsonNumber(frame.lod_bias) : OrderedJson()},
        {"fovea_pixels", frame.fresh && frame.fovea_pixels > 0 ? OrderedJson(frame.fovea_pixels) : OrderedJson()},
        {"busy_ms", frame.busy_ms},
        {"copy_ms", frame.copy_ms},
        {"place", frame.moved ? placeJson(*frame.moved) : OrderedJson()},
    };
    const std::string text = jsonText(line, -1) + "\n";
    if (std::fwrite(text.data(), 1, text.size(), m_file) != text.size() || std::fflush(m_file) != 0)
        failOutput(m_path, "cannot be written", errno);
}

void XrLog::sumUp(XrSummary& summary) const
{
    summary.frames = m_frames;
    summary.visible = m_visible;
    summary.untracked = m_untracked;
    summary.missed = m_missed;
    summary.pictures = m_pictures;
    summary.age = spreadOf(m_ages);
    summary.off_ms = spreadOf(m_off);
    summary.busy_ms = spreadOf(m_busy);
    summary.latency_ms = spreadOf(m_latency);
    summary.ages.assign(kAges + 1, 0);
    for (const double age : m_ages)
        ++summary.ages[std::min(size_t(age), kAges)];
}

} // namespace gsc
