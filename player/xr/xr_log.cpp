// SPDX-License-Identifier: Apache-2.0
#include "player/xr/xr_log.h"

#include "player/xr/place_file.h"

namespace gsc {

namespace {

constexpr size_t kAges = 8; // number of ages counted one by one: 0 to 7 refreshes

} // namespace

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
    if (!m_file.open())
        return;
    const bool shows = frame.shows > 0;
    m_file.add({
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
        {"detail", frame.fresh ? jsonNumber(frame.detail) : OrderedJson()},
        {"fovea_pixels", frame.fresh && frame.fovea_pixels > 0 ? OrderedJson(frame.fovea_pixels) : OrderedJson()},
        {"gaze", frame.fresh && !frame.gaze.empty() ? OrderedJson(frame.gaze) : OrderedJson()},
        {"anchors_absent", frame.fresh ? OrderedJson(frame.anchors_absent) : OrderedJson()},
        {"busy_ms", frame.busy_ms},
        {"copy_ms", frame.copy_ms},
        {"place", frame.moved ? placeJson(*frame.moved) : OrderedJson()},
    });
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
