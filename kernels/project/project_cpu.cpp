// SPDX-License-Identifier: Apache-2.0
// Projects on a CPU with one Gaussian in each lane. The order of operations is that of kernels/math/projection.h.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/project/project_cpu.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "kernels/simd/simd_math-inl.h"
#include "kernels/project/covariance-inl.h"
#include "kernels/math/projection.h"
#include "kernels/project/project.h"

#include <algorithm>
#include <cfloat>
#include <cmath>
#include <cstring>

HWY_BEFORE_NAMESPACE();
namespace gsc {
namespace HWY_NAMESPACE {

using M = hn::Mask<D>;

// Results for a vector of Gaussians, before the visible lanes are picked.
struct ProjectLanes {
    HWY_ALIGN float x[16], y[16], depth[16], conic[3][16], cutoff[16];
    HWY_ALIGN float left[16], top[16], right[16], bottom[16]; // box of pixels, ends inclusive, not rounded yet
};

HWY_INLINE V transformLane(D d, const float* m, V x, V y, V z)
{
    return hn::Add(dot3(hn::Set(d, m[0]), hn::Set(d, m[1]), hn::Set(d, m[2]), x, y, z), hn::Set(d, m[3]));
}

// Pixel of a coordinate: ((n + 1) size - 1) / 2, computed in double (format facts, trap 22).
HWY_INLINE V pixelLane(D d, V n, uint32_t size)
{
#if HWY_HAVE_FLOAT64 && HWY_TARGET != HWY_SCALAR
    const hn::Repartition<double, D> dd;
    const hn::Half<D> dh;
    const auto half = [&](hn::Vec<decltype(dh)> v) {
        const auto one = hn::Set(dd, 1.0);
        const auto wide = hn::MulSub(hn::Add(hn::PromoteTo(dd, v), one), hn::Set(dd, double(size)), one);
        return hn::DemoteTo(dh, hn::Mul(wide, hn::Set(dd, 0.5)));
    };
    return hn::Combine(d, half(hn::UpperHalf(dh, n)), half(hn::LowerHalf(dh, n)));
#else
    HWY_ALIGN float lanes[16];
    hn::Store(n, d, lanes);
    for (size_t i = 0; i < hn::Lanes(d); ++i)
        lanes[i] = float(std::fma(double(lanes[i]) + 1.0, double(size), -1.0) * 0.5);
    return hn::Load(d, lanes);
#endif
}

HWY_INLINE M finite(D d, V v)
{
    return hn::Eq(hn::Sub(v, v), hn::Zero(d));
}

struct Covariance {
    V a, b, c;
};

// Covariance on the screen, from c: xx xy xz yy yz zz in world units squared.
HWY_INLINE Covariance screenCovariance(D d, const EyeParams& eye, V tx, V ty, V tz, const V* c)
{
    const V xx = c[0], xy = c[1], xz = c[2], yy = c[3], yz = c[4], zz = c[5];
    const auto limited = [&](V t, float tan_mid, float tan_fov) {
        const float limit = 1.3f * tan_fov;
        const V low = hn::Set(d, tan_mid - limit), high = hn::Set(d, tan_mid + limit);
        return hn::Mul(hn::Min(high, hn::Max(low, hn::Div(t, tz))), tz);
    };
    const V z2 = hn::Mul(tz, tz);
    const V fx = hn::Set(d, eye.focal_x), fy = hn::Set(d, eye.focal_y);
    const V jxx = hn::Div(fx, tz), jxz = hn::Neg(hn::Div(hn::Mul(fx, limited(tx, eye.tan_mid_x, eye.tan_fov_x)), z2));
    const V jyy = hn::Div(fy, tz), jyz = hn::Neg(hn::Div(hn::Mul(fy, limited(ty, eye.tan_mid_y, eye.tan_fov_y)), z2));
    V u[3], v[3];
    for (int i = 0; i < 3; ++i) {
        const V z_row = hn::Set(d, eye.world_to_view[8 + i]);
        u[i] = hn::MulAdd(jxz, z_row, hn::Mul(jxx, hn::Set(d, eye.world_to_view[i])));
        v[i] = hn::MulAdd(jyz, z_row, hn::Mul(jyy, hn::Set(d, eye.world_to_view[4 + i])));
    }
    const V su[3] = {dot3(xx, xy, xz, u[0], u[1], u[2]), dot3(xy, yy, yz, u[0], u[1], u[2]),
                     dot3(xz, yz, zz, u[0], u[1], u[2])};
    const V sv[3] = {dot3(xx, xy, xz, v[0], v[1], v[2]), dot3(xy, yy, yz, v[0], v[1], v[2]),
                     dot3(xz, yz, zz, v[0], v[1], v[2])};
    const V low_pass = hn::Set(d, 0.3f);
    return {hn::Add(dot3(u[0], u[1], u[2], su[0], su[1], su[2]), low_pass), dot3(u[0], u[1], u[2], sv[0], sv[1], sv[2]),
            hn::Add(dot3(v[0], v[1], v[2], sv[0], sv[1], sv[2]), low_pass)};
}

// Computes the first and last pixel of the trainers' tiles along one axis, as floats; first > last if there are none.
HWY_INLINE void tileSpan(D d, bool gsplat, V center, V radius, uint32_t size, V& first, V& last)
{
    const V tile = hn::Set(d, float(kTileSize)), grid = hn::Set(d, float(tileCount(size))), zero = hn::Zero(d);
    V begin, end;
    if (gsplat) {
        const V inverse = hn::Set(d, 1.0f / float(kTileSize)); // exact like a division, since it is a power of two
        const V c = hn::Mul(hn::Add(center, hn::Set(d, 0.5f)), inverse), r = hn::Mul(radius, inverse);
        begin = hn::Floor(hn::Sub(c, r));
        end = hn::Ceil(hn::Add(c, r));
    } else {
        const V inverse = hn::Set(d, 1.0f / float(kTileSize));
        begin = hn::Trunc(hn::Mul(hn::Sub(center, radius), inverse));
        end = hn::Trunc(hn::Mul(hn::Sub(hn::Add(hn::Add(center, radius), tile), hn::Set(d, 1.0f)), inverse));
    }
    begin = hn::Min(hn::Max(begin, zero), grid);
    end = hn::Min(hn::Max(end, zero), grid);
    first = hn::Mul(begin, tile);
    last = hn::Sub(hn::Min(hn::Mul(end, tile), hn::Set(d, float(size))), hn::Set(d, 1.0f));
}

// Computes Splat::cutoff, and half the width and height of the box round every pixel where alpha can reach 1/255, which
// is where q <= 2 ln(255 o). The conic is rounded, and so is the power computed from it, by about 8 epsilon times the
// condition number of the covariance; the margin is four times that.
HWY_INLINE V reachLane(D d, const Covariance& cov, V ac, V det, V opacity, V& width, V& height)
{
    const V slack = hn::MulAdd(hn::Div(ac, det), hn::Set(d, 4e-6f), hn::Set(d, 1e-4f));
    const M loose = hn::Not(hn::And(hn::Gt(det, hn::Zero(d)), hn::Lt(slack, hn::Set(d, 0.1f))));
    // 2e-3 is three times the error of the logarithm
    const V ln = hn::Max(hn::Add(roughLog(d, hn::Mul(opacity, hn::Set(d, 255.0f))), hn::Set(d, 2e-3f)), hn::Zero(d));
    const V cutoff = hn::IfThenElse(loose, hn::Set(d, kLooseCutoff), hn::MulAdd(ln, slack, ln));
    const V reach = hn::Add(cutoff, cutoff), margin = hn::Set(d, 0.01f), all = hn::Set(d, 1e9f);
    width = hn::IfThenElse(loose, all, hn::Add(hn::Sqrt(hn::Mul(reach, cov.a)), margin));
    height = hn::IfThenElse(loose, all, hn::Add(hn::Sqrt(hn::Mul(reach, cov.c)), margin));
    return cutoff;
}

// Reads Gaussians in the layout in which decode leaves them.
struct DecodedGaussians {
    const GaussianBlock& g;

    [[nodiscard]] uint32_t count() const { return g.count; }
    [[nodiscard]] const float* position(size_t at, int i) const { return g.position[i] + at; }
    [[nodiscard]] const float* opacity(size_t at) const { return g.opacity + at; }
    [[nodiscard]] const float* color(size_t at, int i) const { return g.color[i] + at; }
    void putOrigin(size_t at, uint16_t* origins, uint32_t to) const { origins[to] = g.origin[at]; }
    HWY_INLINE void covariance(D d, size_t at, V* c) const
    {
        const V scale[3] = {hn::LoadU(d, g.scale[0] + at), hn::LoadU(d, g.scale[1] + at),
                            hn::LoadU(d, g.scale[2] + at)};
        V q[4];
        rotation(d, at, q);
        worldCovariance(d, scale, q, c);
    }
    // Mask of the Gaussians at index `at` and on whose quaternion is not zero.
    HWY_INLINE M rotated(D d, size_t at) const
    {
        V q[4];
        rotation(d, at, q);
        const V norm = hn::Add(hn::Add(hn::Abs(q[0]), hn::Abs(q[1])), hn::Add(hn::Abs(q[2]), hn::Abs(q[3])));
        return hn::Ne(norm, hn::Zero(d));
    }

private:
    HWY_INLINE void rotation(D d, size_t at, V* q) const
    {
        for (int i = 0; i < 4; ++i)
            q[i] = hn::LoadU(d, g.rotation[i] + at);
    }
};

struct KeptGaussians {
    const GaussianTiles& g;

    [[nodiscard]] uint32_t count() const { return g.count; }
    [[nodiscard]] const float* position(size_t at, int i) const { return row(at, kTilePosition + uint32_t(i)); }
    [[nodiscard]] const float* opacity(size_t at) const { return row(at, kTileOpacity); }
    [[nodiscard]] const float* color(size_t at, int i) const { return row(at, kTileColor + uint32_t(i)); }
    void putOrigin(size_t, uint16_t*, uint32_t) const {} // does nothing, since Gaussians in tiles have no origins
    HWY_INLINE void covariance(D d, size_t at, V* c) const
    {
        for (uint32_t i = 0; i < 6; ++i)
            c[i] = hn::LoadU(d, row(at, kTileCovariance + i));
    }
    HWY_INLINE M rotated(D d, size_t) const { return hn::Eq(hn::Zero(d), hn::Zero(d)); }

private:
    [[nodiscard]] const float* row(size_t at, uint32_t which) const
    {
        return g.values + at / kMaxLanes * kTileValues + which * kMaxLanes + at % kMaxLanes;
    }
};

// Projects one vector of Gaussians. Returns the lanes to keep; `dropped` gets the lanes that are not finite.
template <class Gaussians>
HWY_INLINE M projectVector(D d, const ProjectArgs& args, const Gaussians& g, size_t at, M in_range, ProjectLanes& out,
                           M& dropped)
{
    const EyeParams& eye = *args.eye;
    const bool gsplat = args.rules.gsplat;
    const V px = hn::LoadU(d, g.position(at, 0)), py = hn::LoadU(d, g.position(at, 1)),
            pz = hn::LoadU(d, g.position(at, 2));
    const float* w = eye.world_to_view;
    const V tx = transformLane(d, w, px, py, pz), ty = transformLane(d, w + 4, px, py, pz),
            tz = transformLane(d, w + 8, px, py, pz);
    const V near_z = hn::Set(d, args.rules.near_z);
    const M outside =
        gsplat ? hn::Or(hn::Lt(tz, near_z), hn::Gt(tz, hn::Set(d, args.rules.far_z))) : hn::Le(tz, near_z);
    M keep = hn::AndNot(outside, in_range); // NaN passes here and is counted below
    dropped = hn::AndNot(in_range, in_range);
    if (hn::AllFalse(d, keep))
        return keep;
    V x, y;
    if (gsplat) {
        const V half = hn::Set(d, 0.5f);
        const auto pixel = [&](float focal, V t, float axis) {
            return hn::Sub(hn::Add(hn::Div(hn::Mul(hn::Set(d, focal), t), tz), hn::Set(d, axis)), half);
        };
        x = pixel(eye.focal_x, tx, axisPixel(eye.width, eye.focal_x, eye.tan_mid_x));
        y = pixel(eye.focal_y, ty, axisPixel(eye.height, eye.focal_y, eye.tan_mid_y));
        keep = hn::And(g.rotated(d, at), keep);
    } else {
        const float* f = eye.full_projection;
        const V inv_w =
            hn::Div(hn::Set(d, 1.0f), hn::Add(transformLane(d, f + 12, px, py, pz), hn::Set(d, 0.0000001f)));
        x = pixelLane(d, hn::Mul(transformLane(d, f, px, py, pz), inv_w), eye.width);
        y = pixelLane(d, hn::Mul(transformLane(d, f + 4, px, py, pz), inv_w), eye.height);
    }

    V world[6];
    g.covariance(d, at, world);
    const Covariance cov = screenCovariance(d, eye, tx, ty, tz, world);
    const V zero = hn::Zero(d), ac = hn::Mul(cov.a, cov.c);
    const V det = hn::MulSub(cov.a, cov.c, hn::Mul(cov.b, cov.b));
    keep = hn::AndNot(gsplat ? hn::Not(hn::Gt(det, zero)) : hn::Eq(det, zero), keep);
    const V inv_det = hn::Div(hn::Set(d, 1.0f), det);
    const V conic[3] = {hn::Mul(cov.c, inv_det), hn::Neg(hn::Mul(cov.b, inv_det)), hn::Mul(cov.a, inv_det)};
    M ok = hn::And(hn::And(finite(d, x), finite(d, y)), finite(d, tz));
    for (int i = 0; i < 3; ++i)
        ok = hn::And(ok, hn::And(finite(d, conic[i]), finite(d, hn::LoadU(d, g.color(at, i)))));
    dropped = hn::AndNot(ok, keep);
    keep = hn::And(keep, ok);

    const V mid = hn::Mul(hn::Set(d, 0.5f), hn::Add(cov.a, cov.c));
    V argument = hn::MulSub(mid, mid, det);
    const V floor = hn::Set(d, args.rules.eigen_floor);
    argument = hn::IfThenElse(hn::Gt(argument, floor), argument, floor);
    const V root = hn::Sqrt(argument);
    const V radius = hn::Min(hn::Ceil(hn::Mul(hn::Set(d, 3.0f), hn::Sqrt(hn::Add(mid, root)))),
                             hn::Set(d, 2147483648.0f)); // limits the value, since CUDA's conversion saturates
    keep = hn::And(keep, hn::Gt(radius, zero));
    if (gsplat) {
        const auto misses = [&](V center, uint32_t size) {
            const V c = hn::Add(center, hn::Set(d, 0.5f));
            return hn::Or(hn::Le(hn::Add(c, radius), zero), hn::Ge(hn::Sub(c, radius), hn::Set(d, float(size))));
        };
        keep = hn::AndNot(hn::Or(misses(x, eye.width), misses(y, eye.height)), keep);
    }
    V left, right, top, bottom;
    tileSpan(d, gsplat, x, radius, eye.width, left, right);
    tileSpan(d, gsplat, y, radius, eye.height, top, bottom);

    V width, height;
    const V cutoff = reachLane(d, cov, ac, det, hn::LoadU(d, g.opacity(at)), width, height);
    const ColumnRange columns = args.columns.within(eye.width);
    left = hn::Max(hn::Max(left, hn::Set(d, float(columns.first))), hn::Ceil(hn::Sub(x, width)));
    right = hn::Min(hn::Min(right, hn::Set(d, float(columns.end) - 1.0f)), hn::Floor(hn::Add(x, width)));
    top = hn::Max(top, hn::Ceil(hn::Sub(y, height)));
    bottom = hn::Min(bottom, hn::Floor(hn::Add(y, height)));
    keep = hn::And(keep, hn::And(hn::Le(left, right), hn::Le(top, bottom)));

    hn::Store(x, d, out.x);
    hn::Store(y, d, out.y);
    hn::Store(tz, d, out.depth);
    for (int i = 0; i < 3; ++i)
        hn::Store(conic[i], d, out.conic[i]);
    hn::Store(cutoff, d, out.cutoff);
    hn::Store(left, d, out.left);
    hn::Store(right, d, out.right);
    hn::Store(top, d, out.top);
    hn::Store(bottom, d, out.bottom);
    return keep;
}

template <class Gaussians>
HWY_INLINE ProjectCounts projectAll(const ProjectArgs& args, const Gaussians& g, Splat* splats, uint32_t* depth_bits,
                                    uint16_t* origins)
{
    const D d;
    const size_t lanes = hn::Lanes(d);
    ProjectLanes out;
    ProjectCounts counts{};
    const size_t vectors = (g.count() + lanes - 1) / lanes;
    const size_t ahead = args.ahead != nullptr && vectors > 0 ? args.ahead->lines() / vectors + 1 : 0;
    for (size_t at = 0; at < g.count(); at += lanes) {
        M dropped;
        if (ahead > 0)
            args.ahead->ask(ahead);
        const M keep = projectVector(d, args, g, at, hn::FirstN(d, g.count() - at), out, dropped);
        counts.dropped += uint32_t(hn::CountTrue(d, dropped));
        for (uint32_t kept = maskBits(keep); kept != 0; kept &= kept - 1) {
            const uint32_t i = uint32_t(__builtin_ctz(kept));
            const size_t from = at + i;
            const uint32_t to = counts.splats++;
            splats[to] = {out.x[i],
                          out.y[i],
                          {out.conic[0][i], out.conic[1][i], out.conic[2][i]},
                          *g.opacity(from),
                          {*g.color(from, 0), *g.color(from, 1), *g.color(from, 2)},
                          out.cutoff[i],
                          uint16_t(out.left[i]),
                          uint16_t(out.top[i]),
                          uint16_t(out.right[i]),
                          uint16_t(out.bottom[i])};
            std::memcpy(depth_bits + to, out.depth + i, sizeof(uint32_t));
            g.putOrigin(from, origins, to);
        }
    }
    return counts;
}

ProjectCounts projectBlock(const ProjectArgs& args, const GaussianBlock& gaussians, Splat* splats, uint32_t* depth_bits,
                           uint16_t* origins)
{
    return projectAll(args, DecodedGaussians{gaussians}, splats, depth_bits, origins);
}

ProjectCounts projectTiles(const ProjectArgs& args, const GaussianTiles& gaussians, Splat* splats, uint32_t* depth_bits)
{
    return projectAll(args, KeptGaussians{gaussians}, splats, depth_bits, nullptr);
}

} // namespace HWY_NAMESPACE
} // namespace gsc
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gsc {

HWY_EXPORT(projectBlock);
HWY_EXPORT(projectTiles);

ProjectCounts projectBlockCpu(const ProjectArgs& args, const GaussianBlock& gaussians, Splat* splats,
                              uint32_t* depth_bits, uint16_t* origins)
{
    return HWY_DYNAMIC_DISPATCH(projectBlock)(args, gaussians, splats, depth_bits, origins);
}

ProjectCounts projectTilesCpu(const ProjectArgs& args, const GaussianTiles& gaussians, Splat* splats,
                              uint32_t* depth_bits)
{
    return HWY_DYNAMIC_DISPATCH(projectTiles)(args, gaussians, splats, depth_bits);
}

} // namespace gsc
#endif
