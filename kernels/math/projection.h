// SPDX-License-Identifier: Apache-2.0
// The rasteriser's preprocessing (format facts 7.2, 7.3, 7.7): what an anchor is tested with and a Gaussian drawn with.
// One copy, templated on the precision; operations are in upstream's order.
#pragma once

#include "kernels/math/eye.h"
#include "kernels/math/real.h"

namespace gsc {

template <typename Real>
struct Covariance3 {
    Real xx, xy, xz, yy, yz, zz;
};

template <typename Real>
struct Covariance2 {
    Real a, b, c; // xx, xy, yy in pixels squared
};

// Tiles [x0, x1) x [y0, y1).
struct TileRect {
    int32_t x0, y0, x1, y1;

    [[nodiscard]] GSC_HD bool empty() const { return x1 <= x0 || y1 <= y0; }
};

template <typename Real>
struct Footprint {
    Real x, y;  // pixels, centres at integers
    Real depth; // view z
    Covariance2<Real> cov;
    Real conic[3];
    int32_t radius; // pixels, 3 sigma of the larger axis
    TileRect tiles;
    bool visible;
    bool finite; // false: upstream's behaviour is undefined or paints the whole image (traps 18, 19)
};

// A row of a matrix times a point, contracted as upstream's compiler does it.
// note: view z orders the splats, so its last bit is part of the image; without the fused steps the worst golden view
// falls from 106 to 86 dB
template <typename Real>
GSC_HD Real transformRow(const Real* m, const Vec3<Real>& p)
{
    return std::fma(m[2], p.z, std::fma(m[1], p.y, m[0] * p.x)) + m[3];
}

template <typename Real>
GSC_HD Vec3<Real> viewPoint(const EyeOf<Real>& eye, const Vec3<Real>& p)
{
    const Real* m = eye.world_to_view;
    return {transformRow(m, p), transformRow(m + 4, p), transformRow(m + 8, p)};
}

// q / max(|q|, 1e-12), order w x y z. A zero quaternion stays zero, which covariance3() turns into no rotation
// (trap 16).
template <typename Real>
GSC_HD void normalizeQuaternion(Real* q)
{
    const Real norm = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    const Real divisor = norm < Real(1e-12) ? Real(1e-12) : norm;
    for (int i = 0; i < 4; ++i)
        q[i] /= divisor;
}

// R diag(s^2) R^T. The quaternion is used as it is.
template <typename Real>
GSC_HD Covariance3<Real> covariance3(const Real* scale, const Real* q)
{
    const Real w = q[0], x = q[1], y = q[2], z = q[3];
    const Real r[9] = {
        Real(1) - Real(2) * (y * y + z * z), Real(2) * (x * y - w * z),           Real(2) * (x * z + w * y),
        Real(2) * (x * y + w * z),           Real(1) - Real(2) * (x * x + z * z), Real(2) * (y * z - w * x),
        Real(2) * (x * z - w * y),           Real(2) * (y * z + w * x),           Real(1) - Real(2) * (x * x + y * y)};
    Real m[9];
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
            m[3 * i + j] = scale[j] * r[3 * i + j];
    const auto row = [&m](int i, int j) {
        return m[3 * i] * m[3 * j] + m[3 * i + 1] * m[3 * j + 1] + m[3 * i + 2] * m[3 * j + 2];
    };
    return {row(0, 0), row(0, 1), row(0, 2), row(1, 1), row(1, 2), row(2, 2)};
}

// J Rw S Rw^T J^T plus the low pass of 0.3 square pixels. t: the point in view space.
template <typename Real>
GSC_HD Covariance2<Real> covariance2(const EyeOf<Real>& eye, const Vec3<Real>& t, const Covariance3<Real>& s)
{
    // upstream's limit, about the image's middle
    const Real limit_x = Real(1.3f) * eye.tan_fov_x, limit_y = Real(1.3f) * eye.tan_fov_y;
    const Real tx = minNumber(eye.tan_mid_x + limit_x, maxNumber(eye.tan_mid_x - limit_x, t.x / t.z)) * t.z;
    const Real ty = minNumber(eye.tan_mid_y + limit_y, maxNumber(eye.tan_mid_y - limit_y, t.y / t.z)) * t.z;
    const Real jxx = eye.focal_x / t.z, jxz = -(eye.focal_x * tx) / (t.z * t.z);
    const Real jyy = eye.focal_y / t.z, jyz = -(eye.focal_y * ty) / (t.z * t.z);
    const Real* w = eye.world_to_view;
    const Real u[3] = {jxx * w[0] + jxz * w[8], jxx * w[1] + jxz * w[9], jxx * w[2] + jxz * w[10]};
    const Real v[3] = {jyy * w[4] + jyz * w[8], jyy * w[5] + jyz * w[9], jyy * w[6] + jyz * w[10]};
    const Real su[3] = {s.xx * u[0] + s.xy * u[1] + s.xz * u[2], s.xy * u[0] + s.yy * u[1] + s.yz * u[2],
                        s.xz * u[0] + s.yz * u[1] + s.zz * u[2]};
    const Real sv[3] = {s.xx * v[0] + s.xy * v[1] + s.xz * v[2], s.xy * v[0] + s.yy * v[1] + s.yz * v[2],
                        s.xz * v[0] + s.yz * v[1] + s.zz * v[2]};
    return {u[0] * su[0] + u[1] * su[1] + u[2] * su[2] + Real(0.3f), u[0] * sv[0] + u[1] * sv[1] + u[2] * sv[2],
            v[0] * sv[0] + v[1] * sv[1] + v[2] * sv[2] + Real(0.3f)};
}

// Where the eye's axis meets the image along one side, pixels from the border.
template <typename Real>
GSC_HD Real axisPixel(uint32_t size, Real focal, Real tan_mid)
{
    return Real(0.5f) * Real(size) - focal * tan_mid;
}

// Pixel of a world point. Upstream computes it in double and stores it in float (trap 22).
template <typename Real>
GSC_HD void pixelCenter(const EyeOf<Real>& eye, bool gsplat, const Vec3<Real>& p, const Vec3<Real>& t, Real& x, Real& y)
{
    if (gsplat) {
        x = eye.focal_x * t.x / t.z + axisPixel(eye.width, eye.focal_x, eye.tan_mid_x) - Real(0.5f);
        y = eye.focal_y * t.y / t.z + axisPixel(eye.height, eye.focal_y, eye.tan_mid_y) - Real(0.5f);
        return;
    }
    const Real* m = eye.full_projection;
    const Real inv_w = Real(1) / (transformRow(m + 12, p) + Real(0.0000001f));
    const Real hx = transformRow(m, p), hy = transformRow(m + 4, p);
    x = Real(((double(hx * inv_w) + 1.0) * double(eye.width) - 1.0) * 0.5);
    y = Real(((double(hy * inv_w) + 1.0) * double(eye.height) - 1.0) * 0.5);
}

// Tiles of the square of half-width `radius` round a pixel.
template <typename Real>
GSC_HD TileRect tileRect(const EyeOf<Real>& eye, bool gsplat, Real x, Real y, int32_t radius)
{
    const int32_t grid_x = int32_t(tileCount(eye.width)), grid_y = int32_t(tileCount(eye.height));
    const Real r = Real(radius), tile = Real(kTileSize);
    if (gsplat) {
        const Real cx = (x + Real(0.5f)) / tile, cy = (y + Real(0.5f)) / tile, rt = r / tile;
        return {clampInt(saturatingInt(std::floor(cx - rt)), 0, grid_x),
                clampInt(saturatingInt(std::floor(cy - rt)), 0, grid_y),
                clampInt(saturatingInt(std::ceil(cx + rt)), 0, grid_x),
                clampInt(saturatingInt(std::ceil(cy + rt)), 0, grid_y)};
    }
    return {clampInt(saturatingInt((x - r) / tile), 0, grid_x), clampInt(saturatingInt((y - r) / tile), 0, grid_y),
            clampInt(saturatingInt((x + r + tile - Real(1)) / tile), 0, grid_x),
            clampInt(saturatingInt((y + r + tile - Real(1)) / tile), 0, grid_y)};
}

// Half-width of the square that upstream covers, pixels.
template <typename Real>
GSC_HD int32_t splatRadius(const Covariance2<Real>& cov, Real det, Real eigen_floor)
{
    const Real mid = Real(0.5f) * (cov.a + cov.c);
    const Real root = std::sqrt(maxNumber(eigen_floor, mid * mid - det));
    const Real lambda = maxNumber(mid + root, mid - root);
    return saturatingInt(std::ceil(Real(3) * std::sqrt(lambda)));
}

// Everything of 7.2 and 7.3 for one ellipsoid. `scale` are standard deviations in world units, `q` is normalised.
template <typename Real>
GSC_HD Footprint<Real> footprint(const EyeOf<Real>& eye, const RasterConstants& rules, const Vec3<Real>& p,
                                 const Real* scale, const Real* q)
{
    Footprint<Real> f{};
    f.finite = true;
    const Vec3<Real> t = viewPoint<Real>(eye, p);
    f.depth = t.z;
    if (rules.gsplat ? (t.z < Real(rules.near_z) || t.z > Real(rules.far_z)) : t.z <= Real(rules.near_z))
        return f;
    if (rules.gsplat && q[0] == Real(0) && q[1] == Real(0) && q[2] == Real(0) && q[3] == Real(0))
        return f; // its rsqrt makes NaN of it, and that culls
    pixelCenter<Real>(eye, rules.gsplat, p, t, f.x, f.y);
    f.cov = covariance2<Real>(eye, t, covariance3(scale, q));
    const Real det = f.cov.a * f.cov.c - f.cov.b * f.cov.b;
    if (rules.gsplat ? !(det > Real(0)) : det == Real(0)) // negative ones survive upstream (trap 21)
        return f;
    const Real inv_det = Real(1) / det;
    f.conic[0] = f.cov.c * inv_det;
    f.conic[1] = -f.cov.b * inv_det;
    f.conic[2] = f.cov.a * inv_det;
    f.radius = splatRadius(f.cov, det, Real(rules.eigen_floor));
    f.finite = isFinite(f.x) && isFinite(f.y) && isFinite(t.z) && isFinite(f.conic[0]) && isFinite(f.conic[1]) &&
               isFinite(f.conic[2]);
    if (rules.gsplat) {
        const Real cx = f.x + Real(0.5f), cy = f.y + Real(0.5f), r = Real(f.radius);
        if (cx + r <= 0 || cx - r >= Real(eye.width) || cy + r <= 0 || cy - r >= Real(eye.height))
            return f;
    }
    f.tiles = tileRect<Real>(eye, rules.gsplat, f.x, f.y, f.radius);
    f.visible = f.radius > 0 && !f.tiles.empty();
    return f;
}

} // namespace gsc
