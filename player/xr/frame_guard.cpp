// SPDX-License-Identifier: Apache-2.0
#include "player/xr/frame_guard.h"

#include <gsc/frame_types.h>

#include <algorithm>
#include <cmath>

namespace gsc {

namespace {

double levelsOf(const FrameGuardOptions& options)
{
    return options.finest_bias - options.coarsest_bias;
}

// As many as there are below what a frame may be asked for.
double doublingsOf(const FrameGuardOptions& options)
{
    if (!(options.fovea_pixels > 0))
        return 0;
    return std::clamp(std::log2(double(kMostFoveaPixels) / options.fovea_pixels), 0.0, FrameGuard::kFoveaDoublings);
}

} // namespace

FrameGuard::FrameGuard(const FrameGuardOptions& options)
    : m_options(options), m_levels_first(std::min(levelsOf(options), kLevelsFirst)), m_doublings(doublingsOf(options)),
      m_control({options.target_ms, 0, -(levelsOf(options) + m_doublings)})
{
}

double FrameGuard::lodBias() const
{
    const double behind = std::max(spent() - m_levels_first - m_doublings, 0.0);
    return m_options.finest_bias - std::min(spent(), m_levels_first) - behind;
}

double FrameGuard::foveaPixels() const
{
    const double pixels = m_options.fovea_pixels * std::exp2(std::clamp(spent() - m_levels_first, 0.0, m_doublings));
    return std::min(pixels, double(kMostFoveaPixels)); // rounding
}

} // namespace gsc
