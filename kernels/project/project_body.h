// SPDX-License-Identifier: Apache-2.0
// Projection of one decoded Gaussian, scalar.
#pragma once

#include "kernels/decode/decode_body.h"
#include "kernels/math/projection.h"

namespace gsc {

// Footprint of a decoded Gaussian; `finite` also covers its colour, which footprint() does not see.
template <typename Real>
GSC_HD Footprint<Real> projectGaussian(const EyeOf<Real>& eye, const RasterConstants& rules, const GaussianOf<Real>& g)
{
    Footprint<Real> f =
        footprint<Real>(eye, rules, Vec3<Real>{g.position[0], g.position[1], g.position[2]}, g.scale, g.rotation);
    f.finite = f.finite && isFinite(g.color[0]) && isFinite(g.color[1]) && isFinite(g.color[2]);
    return f;
}

} // namespace gsc
