// SPDX-License-Identifier: Apache-2.0
// Scalar helpers that mean the same on a CPU and on a GPU, for float and for double.
#pragma once

#include "format/hostdev.h"

#include <cmath>
#include <cstdint>

namespace gsc {

template <typename Real>
struct Vec3 {
    Real x, y, z;
};

// fmax and fmin of IEEE 754-2008: the operand that is a number, as CUDA's max and min do; std::fmax is a library call.
template <typename Real>
GSC_HD Real maxNumber(Real a, Real b)
{
    return (a > b || b != b) ? a : b;
}

template <typename Real>
GSC_HD Real minNumber(Real a, Real b)
{
    return (a < b || b != b) ? a : b;
}

template <typename Real>
GSC_HD bool isFinite(Real v)
{
    return v - v == Real(0);
}

// CUDA's conversion: truncates, saturates, NaN gives 0. x86 gives INT_MIN for all three.
template <typename Real>
GSC_HD int32_t saturatingInt(Real v)
{
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

template <typename Real>
GSC_HD Real sigmoid(Real v)
{
    return Real(1) / (Real(1) + std::exp(-v));
}

} // namespace gsc
