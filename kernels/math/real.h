// SPDX-License-Identifier: Apache-2.0
// Helpers for numbers that give equal results on a CPU and on a GPU, for float and double.
#pragma once

#include <gsc/hostdev.h>

#include <cmath>
#include <cstdint>

namespace gsc {

template <typename Real>
struct Vec3 {
    Real x, y, z;
};

// fmax and fmin of IEEE 754-2008: if one operand is NaN they return the other, as CUDA's max and min do. std::fmax is
// not used since it is a library call.
template <typename Real>
GSC_HD Real maxNumber(Real a, Real b)
{
#ifdef __CUDA_ARCH__
    return max(a, b);
#endif
    return (a > b || b != b) ? a : b;
}

template <typename Real>
GSC_HD Real minNumber(Real a, Real b)
{
#ifdef __CUDA_ARCH__
    return min(a, b);
#endif
    return (a < b || b != b) ? a : b;
}

template <typename Real>
GSC_HD bool isFinite(Real v)
{
    return v - v == Real(0);
}

// Conversion to int32_t as CUDA does it: truncates and saturates; NaN gives 0. On x86 a plain conversion gives INT_MIN
// for NaN and whatever is out of range.
template <typename Real>
GSC_HD int32_t saturatingInt(Real v)
{
#ifdef __CUDA_ARCH__
    if constexpr (sizeof(Real) == sizeof(float))
        return int32_t(v);
#endif
    if (!(v == v))
        return 0;
    if (v >= Real(2147483648.0))
        return INT32_MAX;
    if (v <= Real(-2147483648.0))
        return INT32_MIN;
    return int32_t(v);
}

GSC_HD int32_t clampInt(int32_t v, int32_t low, int32_t high)
{
    return v < low ? low : (v > high ? high : v);
}

// Quotients and roots that are rounded correctly, like those of the operators, where arguments and results are normal
// numbers. For all other numbers a GPU's compiler adds a branch to each operator, and schedules nothing across it;
// these functions have no branch. On a GPU a divisor above 2^126 gives zero, a divisor of zero or an infinite dividend
// gives NaN, and the root of a number that is not normal is the number itself. Such values are in no picture, since
// Gaussians that are not finite are dropped.
#ifdef __CUDA_ARCH__
__device__ inline float approximateReciprocal(float v)
{
    float r;
    asm("rcp.approx.ftz.f32 %0, %1;" : "=f"(r) : "f"(v));
    return r;
}

// A divisor of several numbers; the quotients share one reciprocal.
template <typename Real>
struct Divisor {
    Real value, inverse;

    GSC_HD explicit Divisor(Real v) : value(v)
    {
        if constexpr (sizeof(Real) == sizeof(float)) {
            const float r = approximateReciprocal(v);
            inverse = r == 0.0f ? 0.0f : fmaf(r, fmaf(-v, r, 1.0f), r);
        }
    }
    [[nodiscard]] GSC_HD Real under(Real a) const // returns a / value
    {
        if constexpr (sizeof(Real) == sizeof(float)) {
            const float q = a * inverse;
            return inverse == 0.0f ? q : fmaf(inverse, fmaf(-value, q, a), q);
        } else {
            return a / value;
        }
    }
};

template <typename Real>
GSC_HD Real reciprocal(Real v)
{
    if constexpr (sizeof(Real) == sizeof(float))
        return Divisor<Real>(v).inverse;
    else
        return Real(1) / v;
}

template <typename Real>
GSC_HD Real squareRoot(Real v)
{
    if constexpr (sizeof(Real) == sizeof(float)) {
        float r;
        asm("rsqrt.approx.ftz.f32 %0, %1;" : "=f"(r) : "f"(v));
        const float root = v * r;
        return r == 0.0f || r > 3e38f ? v : fmaf(fmaf(-root, root, v), 0.5f * r, root); // v itself for 0 and infinity
    } else {
        return std::sqrt(v);
    }
}
#else
template <typename Real>
struct Divisor {
    Real value;

    explicit Divisor(Real v) : value(v) {}
    [[nodiscard]] Real under(Real a) const { return a / value; }
};

template <typename Real>
GSC_HD Real reciprocal(Real v)
{
    return Real(1) / v;
}

template <typename Real>
GSC_HD Real squareRoot(Real v)
{
    return std::sqrt(v);
}
#endif

template <typename Real>
GSC_HD Real sigmoid(Real v)
{
    return reciprocal(Real(1) + std::exp(-v));
}

} // namespace gsc
