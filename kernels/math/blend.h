// SPDX-License-Identifier: Apache-2.0
// Blends one Gaussian into one pixel, from front to back (format facts 7.5).
#pragma once

#include "kernels/math/eye.h"
#include "kernels/math/real.h"

namespace gsc {

// Share of the light: the depth of a pixel is that of the Gaussian behind which less than this goes on
// (FrameTarget::depth).
constexpr float kHalfLight = 0.5f;

template <typename Real>
struct PixelState {
    Real color[3];
    Real transmittance;
    bool done;
};

// Exponent of the Gaussian at a pixel; (dx, dy) = centre - pixel. Products and sums here and below are fused where the
// trainers' compiler fuses them (kernels/math/README.md).
template <typename Real>
GSC_HD Real gaussianPower(const Real* conic, Real dx, Real dy, bool gsplat = false)
{
    const Real squares = Real(-0.5f) * std::fma(dx, conic[0] * dx, dy * (conic[2] * dy));
    return gsplat ? std::fma(-(conic[1] * dx), dy, squares) : squares - dy * (conic[1] * dx);
}

template <typename Real>
GSC_HD void blendStep(const RasterConstants& rules, const Real* conic, Real dx, Real dy, Real opacity,
                      const Real* color, PixelState<Real>& pixel)
{
    const Real power = gaussianPower(conic, dx, dy, rules.gsplat);
    if (power > Real(0))
        return;
    const Real alpha = minNumber(Real(rules.alpha_cap), opacity * std::exp(power));
    if (alpha < Real(1) / Real(255))
        return;
    const Real next = pixel.transmittance * (Real(1) - alpha);
    if (rules.gsplat ? next <= Real(rules.stop) : next < Real(rules.stop)) {
        pixel.done = true; // the Gaussian that would bring the light below the bound is not drawn
        return;
    }
    const Real weight = pixel.transmittance * alpha;
    for (int c = 0; c < 3; ++c)
        pixel.color[c] = rules.gsplat ? std::fma(weight, color[c], pixel.color[c])
                                      : std::fma(pixel.transmittance, alpha * color[c], pixel.color[c]);
    pixel.transmittance = next;
}

} // namespace gsc
