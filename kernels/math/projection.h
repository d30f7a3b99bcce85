// SPDX-License-Identifier: Apache-2.0
// Preprocessing of the trainers' rasteriser (format facts 7.2, 7.3, 7.7), for testing an anchor and for drawing a
// Gaussian. One copy, templated on the precision. Products and sums are fused where the trainers' compiler fuses them
// (kernels/math/README.md), and nowhere else: device code that includes this for the tier `exact` is therefore compiled
// with -fmad=false, host code without contraction.
#pragma once

#include "kernels/math/eye.h"
#include "kernels/math/real.h"

namespace gsc {

// A Gaussian as it is decoded from an anchor for one eye.
template <typename Real>
struct GaussianOf {
    Real position[3]; // centre of the Gaussian, world units
    Real scale[3];    // standard deviations, world units
    Real rotation[4]; // quaternion w x y z, normalised
    Real opacity;
    Real color[3];
    uint64_t order; // emissionOrder(), which orders Gaussians of equal depth
};

template <typename Real>
struct Covariance3 {
    Real xx, xy, xz, yy, yz, zz;
};

template <typename Real>
struct Covariance2 {
    Real a, b, c; // xx, xy, yy, in pixels squared
};

// Rectangle of tiles [x0, x1) x [y0, y1).
struct TileRect {
    int32_t x0, y0, x1, y1;

    [[nodiscard]] GSC_HD bool empty() const { return x1 <= x0 || y1 <= y0; }
};

template <typename Real>
struct Footprint {
    Real x, y;  // pixels; pixel centres are whole numbers
    Real depth; // view z of the centre, world units
    Covariance2<Real> cov;
    Real conic[3];
    int32_t radius; // half-width in pixels of the square that is drawn: 3 sigma of the larger axis
    TileRect tiles;
    bool visible;
    // false: the trainers' code has no defined result, or paints the whole image (format facts, traps 18, 19)
    bool finite;
};

// a . b, fused as the trainers' compiler fuses every sum of three products.
template <typename Real>
GSC_HD Real fusedDot(Real a0, Real a1, Real a2, Real b0, Real b1, Real b2)
{
    return std::fma(a2, b2, std::fma(a0, b0, a1 * b1));
}

// Product of a row of a matrix and a point. note: view z orders the splats, so its last bit affects the image: with
// another order of this sum a city of 18.5 million anchors falls from 110 to 74 dB
template <typename Real>
GSC_HD Real transformRow(const Real* m, const Vec3<Real>& p)
{
    return fusedDot(m[0], m[1], m[2], p.x, p.y, p.z) + m[3];
}

template <typename Real>
GSC_HD Vec3<Real> viewPoint(const EyeOf<Real>& eye, const Vec3<Real>& p)
{
    const Real* m = eye.world_to_view;
    return {transformRow(m, p), transformRow(m + 4, p), transformRow(m + 8, p)};
}

// Divides q by max(|q|, 1e-12); order w x y z. A zero quaternion stays zero, which covariance3() takes as no rotation
// (format facts, trap 16).
template <typename Real>
GSC_HD void normalizeQuaternion(Real* q)
{
    const Real norm = squareRoot(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    const Divisor<Real> divisor(norm < Real(1e-12) ? Real(1e-12) : norm);
    for (int i = 0; i < 4; ++i)
        q[i] = divisor.under(q[i]);
}

// Covariance R diag(s^2) R^T in world units squared. The quaternion must be normalised already.
template <typename Real>
GSC_HD Covariance3<Real> covariance3(const Real* scale, const Real* q)
{
    const Real w = q[0], x = q[1], y = q[2], z = q[3];
    const Real yy = y * y, zz = z * z, xz = x * z, wz = w * z, wx = w * x;
    const Real r[9] = {
        Real(1) - Real(2) * (yy + zz), Real(2) * std::fma(x, y, -wz),          Real(2) * std::fma(w, y, xz),
        Real(2) * std::fma(x, y, wz),  Real(1) - Real(2) * std::fma(x, x, zz), Real(2) * std::fma(y, z, -wx),
        Real(2) * std::fma(-w, y, xz), Real(2) * std::fma(y, z, wx),           Real(1) - Real(2) * std::fma(x, x, yy)};
    Real m[9];
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
            m[3 * i + j] = scale[j] * r[3 * i + j];
    const auto row = [&m](int i, int j) {
        return fusedDot(m[3 * i], m[3 * i + 1], m[3 * i + 2], m[3 * j], m[3 * j + 1], m[3 * j + 2]);
    };
    return {row(0, 0), row(0, 1), row(0, 2), row(1, 1), row(1, 2), row(2, 2)};
}

// Covariance on the screen: J Rw S Rw^T J^T plus the rasteriser's blur of 0.3 square pixels. t: point in view space.
template <typename Real>
GSC_HD Covariance2<Real> covariance2(const EyeOf<Real>& eye, const Vec3<Real>& t, const Covariance3<Real>& s)
{
    // limit of the trainers' code for the slope, counted from the middle of the image
    const Real limit_x = Real(1.3f) * eye.tan_fov_x, limit_y = Real(1.3f) * eye.tan_fov_y;
    const Divisor<Real> z(t.z), zz(t.z * t.z);
    const Real tx = minNumber(eye.tan_mid_x + limit_x, maxNumber(eye.tan_mid_x - limit_x, z.under(t.x))) * t.z;
    const Real ty = minNumber(eye.tan_mid_y + limit_y, maxNumber(eye.tan_mid_y - limit_y, z.under(t.y))) * t.z;
    const Real jxx = z.under(eye.focal_x), jxz = zz.under(-(eye.focal_x * tx));
    const Real jyy = z.under(eye.focal_y), jyz = zz.under(-(eye.focal_y * ty));
    const Real* w = eye.world_to_view;
    Real u[3], v[3];
    for (int i = 0; i < 3; ++i) {
        u[i] = std::fma(jxz, w[8 + i], jxx * w[i]);
        v[i] = std::fma(jyz, w[8 + i], jyy * w[4 + i]);
    }
    const auto dot = [](const Real* a, const Real* b) { return fusedDot(a[0], a[1], a[2], b[0], b[1], b[2]); };
    const Real rows[3][3] = {{s.xx, s.xy, s.xz}, {s.xy, s.yy, s.yz}, {s.xz, s.yz, s.zz}};
    const Real su[3] = {dot(u, rows[0]), dot(u, rows[1]), dot(u, rows[2])};
    const Real sv[3] = {dot(v, rows[0]), dot(v, rows[1]), dot(v, rows[2])};
    return {dot(u, su) + Real(0.3f), dot(u, sv), dot(v, sv) + Real(0.3f)};
}

// Determinant with the roundings of the trainers' code.
template <typename Real>
GSC_HD Real determinant(const Covariance2<Real>& cov)
{
    return std::fma(cov.a, cov.c, -(cov.b * cov.b));
}

// Place where the eye's axis meets the image along one side, in pixels from the border.
template <typename Real>
GSC_HD Real axisPixel(uint32_t size, Real focal, Real tan_mid)
{
    return Real(0.5f) * Real(size) - focal * tan_mid;
}

// Pixel of a world point. The trainers' code computes it in double and stores it as a float (format facts, trap 22).
template <typename Real>
GSC_HD void pixelCenter(const EyeOf<Real>& eye, bool gsplat, const Vec3<Real>& p, const Vec3<Real>& t, Real& x, Real& y)
{
    if (gsplat) {
        x = eye.focal_x * t.x / t.z + axisPixel(eye.width, eye.focal_x, eye.tan_mid_x) - Real(0.5f);
        y = eye.focal_y * t.y / t.z + axisPixel(eye.height, eye.focal_y, eye.tan_mid_y) - Real(0.5f);
        return;
    }
    const Real* m = eye.full_projection;
    const Real inv_w = reciprocal(transformRow(m + 12, p) + Real(0.0000001f));
    const Real hx = transformRow(m, p), hy = transformRow(m + 4, p);
    x = Real(std::fma(double(hx * inv_w) + 1.0, double(eye.width), -1.0) * 0.5);
    y = Real(std::fma(double(hy * inv_w) + 1.0, double(eye.height), -1.0) * 0.5);
}

// Tiles that the square of half-width `radius` round a pixel touches.
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

// Half-width in pixels of the square in which the trainers' code draws a splat.
template <typename Real>
GSC_HD int32_t splatRadius(const Covariance2<Real>& cov, Real det, Real eigen_floor)
{
    const Real mid = Real(0.5f) * (cov.a + cov.c);
    const Real root = squareRoot(maxNumber(eigen_floor, std::fma(mid, mid, -det)));
    const Real lambda = maxNumber(mid + root, mid - root);
    return saturatingInt(std::ceil(Real(3) * squareRoot(lambda)));
}

// Does format facts 7.2 and 7.3 for one Gaussian. `scale`: standard deviations in world units; `q`: normalised.
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
        return f; // a radius of NaN, because of which the trainers' code draws nothing
    pixelCenter<Real>(eye, rules.gsplat, p, t, f.x, f.y);
    f.cov = covariance2<Real>(eye, t, covariance3(scale, q));
    const Real det = determinant(f.cov);
    // with the trainers' first rasteriser negative determinants are drawn (format facts, trap 21)
    if (rules.gsplat ? !(det > Real(0)) : det == Real(0))
        return f;
    const Real inv_det = reciprocal(det);
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

// Projects a decoded Gaussian. `finite` of the result also covers the colour, which footprint() does not get.
template <typename Real>
GSC_HD Footprint<Real> projectGaussian(const EyeOf<Real>& eye, const RasterConstants& rules, const GaussianOf<Real>& g)
{
    Footprint<Real> f =
        footprint<Real>(eye, rules, Vec3<Real>{g.position[0], g.position[1], g.position[2]}, g.scale, g.rotation);
    f.finite = f.finite && isFinite(g.color[0]) && isFinite(g.color[1]) && isFinite(g.color[2]);
    return f;
}

} // namespace gsc
