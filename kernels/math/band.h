// SPDX-License-Identifier: Apache-2.0
// Bounds of a band of columns: an anchor that can touch no tile of the band need not be decoded.
#pragma once

#include "kernels/math/eye.h"
#include "kernels/math/real.h"

#include <cmath>

namespace gsc {

// A half-space in world coordinates: an object is invisible if n p + offset + sigma_factor * sigma < 0, where p is its
// centre and sigma its largest standard deviation.
struct BoundPlane {
    float n[3];
    float offset;
    float sigma_factor;
};

// Returns true if all objects with centres in the box are invisible. note: written such that NaN never rejects
GSC_HD bool rejects(const BoundPlane& plane, const float* box_min, const float* box_max, float sigma)
{
    float value = plane.offset + plane.sigma_factor * sigma;
    float magnitude = std::fabs(plane.offset) + plane.sigma_factor * sigma;
    for (int i = 0; i < 3; ++i) {
        const float corner = plane.n[i] > 0 ? box_max[i] : box_min[i];
        value += plane.n[i] * corner;
        magnitude += std::fabs(plane.n[i] * corner);
    }
    return value + 1e-5f * magnitude < 0;
}

// Square of an upper bound of the factor by which a view matrix, which may be no pure rotation, changes lengths.
GSC_HD float viewStretch(const float* w)
{
    float stretch = 1;
    for (int i = 0; i < 3; ++i) {
        float sum = 0;
        for (int j = 0; j < 3; ++j)
            sum += std::fabs(w[4 * i] * w[4 * j] + w[4 * i + 1] * w[4 * j + 1] + w[4 * i + 2] * w[4 * j + 2]);
        stretch = maxNumber(stretch, sum);
    }
    return stretch;
}

// Half-space of the objects that reach the pixels from `border` on (beyond) or up to `border` along an axis. `spare`:
// pixels by which a splat may be wider than sigma_factor says.
GSC_HD BoundPlane borderPlane(const EyeParams& eye, int axis, bool beyond, float border, float spare,
                              float sigma_factor)
{
    const float* w = eye.world_to_view;
    const float focal = axis == 0 ? eye.focal_x : eye.focal_y;
    const float middle = 0.5f * (float(axis == 0 ? eye.width : eye.height) - 1);
    // distance of the image's middle from the axis, in pixels
    const float off = focal * (axis == 0 ? eye.tan_mid_x : eye.tan_mid_y);
    const float slope = beyond ? middle - border + spare - off : border - middle + spare + off;
    const float sign = beyond ? focal : -focal;
    BoundPlane plane{};
    for (int i = 0; i < 3; ++i)
        plane.n[i] = sign * w[4 * axis + i] + slope * w[8 + i];
    plane.offset = sign * w[4 * axis + 3] + slope * w[11];
    plane.sigma_factor = sigma_factor;
    return plane;
}

// Bounds of the objects that can touch a tile of the drawn columns. All zero: bounds are not known.
struct EyeBand {
    BoundPlane planes[2]; // planes at the first column and at the last
    float first, last;    // first and last column of pixels that is drawn
    bool whole;           // true: all columns are drawn, so the planes reject nothing
};

// Planes that hold for Gaussians of both rasterisers and tiers. A Gaussian draws within its radius of 3 sigma, to the
// ends of the tiles that touches; where a tier cuts it elsewhere, then where alpha falls below 1/255, which is 3.34
// sigma of the horizontal axis at most. With t the point in view space and s = sigma f / z, the covariance along its
// largest axis is at most s^2 (1 + lx^2 + ly^2) + 0.62, along the horizontal s^2 (1 + lx^2) + 0.3, l being the limits
// of the slope: the radius is at most 3 s sqrt(1 + lx^2 + ly^2) + 3.37 pixels. 1 % and a pixel more allow for rounding.
GSC_HD EyeBand eyeBand(const EyeParams& eye, const ColumnRange& columns)
{
    EyeBand band{};
    const ColumnRange drawn = columns.within(eye.width);
    band.first = float(drawn.first);
    band.last = float(drawn.end) - 1;
    band.whole = drawn.first == 0 && drawn.end == eye.width;
    const float lx = std::fabs(eye.tan_mid_x) + 1.304f * eye.tan_fov_x;
    const float ly = std::fabs(eye.tan_mid_y) + 1.304f * eye.tan_fov_y;
    const float largest = 3.0f * maxNumber(eye.focal_x, eye.focal_y) * std::sqrt(1 + lx * lx + ly * ly);
    const float horizontal = 3.34f * eye.focal_x * std::sqrt(1 + lx * lx);
    const float reach = 1.01f * maxNumber(largest, horizontal) * std::sqrt(viewStretch(eye.world_to_view));
    // columns of pixels of whole tiles, the last of which may go on beyond the image; the half is for gsplat, whose
    // pixels lie half a pixel further
    const float left = band.first - 0.5f, right = float(tileCount(drawn.end) * kTileSize);
    band.planes[0] = borderPlane(eye, 0, true, left, 4.5f, reach);
    band.planes[1] = borderPlane(eye, 0, false, right, 4.5f, reach);
    return band;
}

// Returns true if a Gaussian with its centre in the box and no standard deviation above sigma can touch a tile of the
// band; may also return true if none can.
GSC_HD bool mayTouch(const EyeBand& band, const float* box_min, const float* box_max, float sigma)
{
    return band.whole ||
           (!rejects(band.planes[0], box_min, box_max, sigma) && !rejects(band.planes[1], box_min, box_max, sigma));
}

} // namespace gsc
