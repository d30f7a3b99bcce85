// SPDX-License-Identifier: Apache-2.0
// EyeParams in the precision that a template asks for, and the rules by which an eye is rendered.
#pragma once

#include <gsc/frame_types.h>

#include <type_traits>

namespace gsc {

template <typename Real>
using EyeOf = std::conditional_t<std::is_same_v<Real, double>, EyeParams64, EyeParams>;

// the trainers' code skips a Gaussian, and a contribution to a pixel, with a smaller alpha
constexpr float kOpacityFloor = 1.0f / 255.0f;

// Constants that differ between the two rasterisers that the trainers install (format facts 7.7).
struct RasterConstants {
    bool gsplat;
    float near_z;
    float far_z;
    float eigen_floor; // smallest argument of the square root in the formula for a splat's radius
    float alpha_cap;
    float stop; // a pixel is finished at a transmittance below it; with gsplat also at an equal one

    bool operator==(const RasterConstants&) const = default;
};

GSC_HD RasterConstants rasterConstants(const ModelParams& params, float near_z)
{
    const bool gsplat = params.raster_rules == uint32_t(RasterRules::Gsplat);
    RasterConstants rules{};
    rules.gsplat = gsplat;
    rules.near_z = near_z > 0 ? near_z : params.near_z;
    rules.far_z = gsplat ? 1e10f : 3.402823466e38f;
    rules.eigen_floor = gsplat ? 0.01f : 0.1f;
    rules.alpha_cap = gsplat ? 0.999f : 0.99f;
    rules.stop = 1e-4f;
    return rules;
}

GSC_HD uint32_t tileCount(uint32_t pixels)
{
    return (pixels + kTileSize - 1) / kTileSize;
}

} // namespace gsc
