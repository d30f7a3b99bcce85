// SPDX-License-Identifier: Apache-2.0
// One Gaussian on one pixel, front to back (format facts 7.5).
#pragma once

#include "kernels/math/eye.h"
#include "kernels/math/real.h"

namespace gsc {

template <typename Real>
struct PixelState {
    Real color[3];
    Real transmittance;
    bool done;
};

// Exponent of the Gaussian at offset (dx, dy) = centre - pixel.
template <typename Real>
GSC_HD Real gaussianPower(const Real* conic, Real dx, Real dy)
{
    return Real(-0.5f) * (conic[0] * dx * dx + conic[2] * dy * dy) - conic[1] * dx * dy;
}

template <typename Real>
GSC_HD void blendStep(const RasterConstants& rules, const Real* conic, Real dx, Real dy, Real opacity,
                      const Real* color, PixelState<Real>& pixel)
{
    const Real power = gaussianPower(conic, dx, dy);
    if (power > Real(0))
        return;
    const Real alpha = minNumber(Real(rules.alpha_cap), opacity * std::exp(power));
    if (alpha < Real(1) / Real(255))
        return;
    const Real next = pixel.transmittance * (Real(1) - alpha);
    if (rules.stop_inclusive ? next <= Real(rules.stop) : next < Real(rules.stop)) {
        pixel.done = true; // the Gaussian that crosses the bound is not drawn
        return;
    }
    for (int c = 0; c < 3; ++c)
        pixel.color[c] += color[c] * alpha * pixel.transmittance;
    pixel.transmittance = next;
}

} // namespace gsc
