// SPDX-License-Identifier: Apache-2.0
#include "runtime/view/frame_guard.h"

#include <algorithm>
#include <cmath>

namespace gsc {

namespace {

double levelsOf(const FrameGuardOptions& options)
{
    return options.finest_bias - options.coarsest_bias;
}

// Number of times that fovea_pixels can be doubled.
double doublingsOf(const FrameGuardOptions& options)
{
    if (!(options.fovea_pixels > 0))
        return 0;
    return std::clamp(std::log2(double(kMostFoveaPixels) / options.fovea_pixels), 0.0, FrameGuard::kFoveaDoublings);
}

} // namespace

FrameGuard::FrameGuard(const FrameGuardOptions& options)
    : m_options(options), m_levels_first(std::min(levelsOf(options), kLevelsFirst)), m_doublings(doublingsOf(options)),
      m_detail(options.detail)
{
}

void FrameGuard::add(double frame_ms)
{
    if (!(frame_ms > 0) || !std::isfinite(frame_ms))
        return;
    m_times[0] = m_times[1];
    m_times[1] = m_times[2];
    m_times[2] = frame_ms;
    m_since = std::min(m_since + 1, kRemade);
    // ignores the first frames of a run, which fill caches and buffers; with detail more of them, which have no copies
    // yet
    m_count = std::min(m_count + 1, kRemade);
    if (m_count < (m_options.detail > 0 ? kRemade : 3))
        return;
    const auto [low, high] = std::minmax(m_times[0], m_times[1]);
    const double median = std::clamp(m_times[2], low, high);
    const double target = m_options.target_ms, error = std::log(kAim * target / median);
    if (median > target)
        fall(error);
    else if (median < (m_detail > 0 ? kQuietCoarse : kQuiet) * target)
        comeBack(error, median);
}

void FrameGuard::setDetail(double pixels)
{
    m_detail = pixels;
    m_since = 0;
}

void FrameGuard::fall(double error)
{
    if (m_detail < m_options.most_detail && remade()) {
        const double next = m_detail > 0 ? m_detail * (error < -kOctave ? 4 : 2) : kFirstDetail;
        return setDetail(std::min(next, m_options.most_detail));
    }
    m_spent = std::min(m_spent - std::max((remade() ? kDown : kBridge) * error, -kMostDown),
                       levelsOf(m_options) + m_doublings);
}

void FrameGuard::comeBack(double error, double median)
{
    if (m_spent > 0)
        m_spent = std::max(m_spent - std::min(kUp * error, m_detail > 0 ? kMostUpCoarse : kMostUp), 0.0);
    else if (!remade() || m_detail <= m_options.detail)
        return;
    else if (const double least = m_options.detail > 0 ? m_options.detail : kFirstDetail; m_detail > least)
        m_detail = std::max(m_detail * std::exp2(-kFiner), least);
    else if (median < kWithout * m_options.target_ms)
        setDetail(m_options.detail);
}

double FrameGuard::lodBias() const
{
    const double behind = std::max(m_spent - m_levels_first - m_doublings, 0.0);
    return m_options.finest_bias - std::min(m_spent, m_levels_first) - behind;
}

double FrameGuard::foveaPixels() const
{
    const double pixels = m_options.fovea_pixels * std::exp2(std::clamp(m_spent - m_levels_first, 0.0, m_doublings));
    return std::min(pixels, double(kMostFoveaPixels)); // at most the limit, which rounding may exceed
}

void FrameGuard::applyTo(FrameOptions& frame) const
{
    frame.lod_bias = float(lodBias());
    frame.detail = float(detail());
    if (m_options.fovea_pixels > 0)
        frame.foveation.smallest = float(foveaPixels());
}

} // namespace gsc
