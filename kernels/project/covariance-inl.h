// SPDX-License-Identifier: Apache-2.0
// Covariances of Gaussians from the outputs of decode. Included once per SIMD target, inside Highway's foreach_target.

#if defined(GSC_KERNELS_PROJECT_COVARIANCE_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef GSC_KERNELS_PROJECT_COVARIANCE_INL_H
#undef GSC_KERNELS_PROJECT_COVARIANCE_INL_H
#else
#define GSC_KERNELS_PROJECT_COVARIANCE_INL_H
#endif

#include "kernels/simd/simd_math-inl.h"

HWY_BEFORE_NAMESPACE();
namespace gsc {
namespace HWY_NAMESPACE {

HWY_INLINE V dot3(V ax, V ay, V az, V bx, V by, V bz)
{
    return hn::MulAdd(az, bz, hn::MulAdd(ax, bx, hn::Mul(ay, by)));
}

// Computes m = R diag(s), row-major, for the Gaussians of a vector.
HWY_INLINE void scaledRotation(D d, const V* scale, const V* q, V* m)
{
    const V one = hn::Set(d, 1.0f), two = hn::Set(d, 2.0f);
    const V w = q[0], x = q[1], y = q[2], z = q[3];
    const auto twice = [two](V v) { return hn::Mul(two, v); };
    const auto diagonal = [&](V sum) { return hn::Sub(one, twice(sum)); };
    const V yy = hn::Mul(y, y), zz = hn::Mul(z, z), xz = hn::Mul(x, z), wz = hn::Mul(w, z), wx = hn::Mul(w, x);
    const V r[9] = {diagonal(hn::Add(yy, zz)),      twice(hn::MulSub(x, y, wz)),    twice(hn::MulAdd(w, y, xz)),
                    twice(hn::MulAdd(x, y, wz)),    diagonal(hn::MulAdd(x, x, zz)), twice(hn::MulSub(y, z, wx)),
                    twice(hn::NegMulAdd(w, y, xz)), twice(hn::MulAdd(y, z, wx)),    diagonal(hn::MulAdd(x, x, yy))};
    for (int i = 0; i < 9; ++i)
        m[i] = hn::Mul(scale[i % 3], r[i]);
}

// Computes the covariance c: xx xy xz yy yz zz, in the square of the unit of `scale`.
HWY_INLINE void worldCovariance(D d, const V* scale, const V* q, V* c)
{
    V m[9];
    scaledRotation(d, scale, q, m);
    const auto row = [&m](int i, int j) {
        return dot3(m[3 * i], m[3 * i + 1], m[3 * i + 2], m[3 * j], m[3 * j + 1], m[3 * j + 2]);
    };
    c[0] = row(0, 0);
    c[1] = row(0, 1);
    c[2] = row(0, 2);
    c[3] = row(1, 1);
    c[4] = row(1, 2);
    c[5] = row(2, 2);
}

} // namespace HWY_NAMESPACE
} // namespace gsc
HWY_AFTER_NAMESPACE();

#endif
