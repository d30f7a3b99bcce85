// SPDX-License-Identifier: Apache-2.0
// exp, tanh, sigmoid and a rough logarithm on vectors. Included once per SIMD target, inside Highway's foreach_target.

#if defined(GSC_KERNELS_SIMD_MATH_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef GSC_KERNELS_SIMD_MATH_INL_H
#undef GSC_KERNELS_SIMD_MATH_INL_H
#else
#define GSC_KERNELS_SIMD_MATH_INL_H
#endif

#include <hwy/highway.h>

#include <bit>
#include <cmath>

HWY_BEFORE_NAMESPACE();
namespace gsc {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Vectors of all stages: as many lanes as the machine has, at most 16 (those of AVX-512, and the row of a tile).
using LaneTag = hn::CappedTag<float, 16>;
using D = LaneTag;
using V = hn::Vec<D>;
using DHalf = hn::Rebind<hwy::float16_t, D>;

// Bits of a mask: bit i is set if lane i is.
template <class Tag>
HWY_INLINE uint32_t maskBits(Tag d, hn::Mask<Tag> mask)
{
    uint8_t bytes[8] = {};
    hn::StoreMaskBits(d, mask, bytes);
    return uint32_t(bytes[0]) | uint32_t(bytes[1]) << 8;
}
HWY_INLINE uint32_t maskBits(hn::Mask<D> mask)
{
    return maskBits(D(), mask);
}

HWY_INLINE hn::Mask<D> maskOf(uint32_t bits)
{
    const uint8_t bytes[8] = {uint8_t(bits), uint8_t(bits >> 8)};
    return hn::LoadMaskBits(D(), bytes);
}

HWY_INLINE void storeHalf(V v, uint16_t* to)
{
    hn::StoreU(hn::DemoteTo(DHalf(), v), DHalf(), reinterpret_cast<hwy::float16_t*>(to));
}

// exp(r) - 1 for |r| <= ln(2) / 2, relative error 1e-8: r + r^2 P(r), where P interpolates at Chebyshev nodes.
HWY_INLINE V expm1Reduced(D d, V r)
{
    // note: Estrin's order of evaluation, in which few operations wait for each other
    const V r2 = hn::Mul(r, r);
    const V low = hn::MulAdd(hn::Set(d, 0.16666576583158002f), r, hn::Set(d, 0.5f));
    const V high = hn::MulAdd(hn::Set(d, 0.008363246669753733f), r, hn::Set(d, 0.04166655410934578f));
    const V p = hn::MulAdd(hn::MulAdd(hn::Set(d, 0.0013926268052670758f), r2, high), r2, low);
    return hn::MulAdd(p, r2, r);
}

// Splits x = n ln(2) + r and returns r; `shifted` has n in its low bits. Precondition: |x| <= 88.
HWY_INLINE V reduceExp(D d, V x, V& shifted)
{
    const V magic = hn::Set(d, 12582912.0f); // 1.5 * 2^23: adding it rounds to a whole number
    shifted = hn::MulAdd(x, hn::Set(d, 1.44269504f), magic);
    const V n = hn::Sub(shifted, magic);
    // note: ln(2) in two parts, so that nothing is lost with large n
    const V r = hn::NegMulAdd(n, hn::Set(d, 0.693359375f), x);
    return hn::NegMulAdd(n, hn::Set(d, -2.12194440e-4f), r);
}

// v * 2^n, with n from the low bits of `shifted`. Precondition: the result is a normal number.
HWY_INLINE V scaleByPower(D d, V v, V shifted)
{
    const hn::RebindToSigned<D> di;
    return hn::BitCast(d, hn::Add(hn::BitCast(di, v), hn::ShiftLeft<23>(hn::BitCast(di, shifted))));
}

// exp for arguments in [-87, 88], with an error of 1 ulp. Callers mask other arguments, whose result has no meaning.
HWY_INLINE V expInRange(D d, V x)
{
    V shifted;
    const V r = reduceExp(d, x, shifted);
    return scaleByPower(d, hn::Add(hn::Set(d, 1.0f), expm1Reduced(d, r)), shifted);
}

// Steps of an octave that exp2Steps() looks up in a table: one for each lane of a vector if that can be a table, else
// 1.
constexpr size_t kOctaveSteps = HWY_TARGET <= HWY_AVX3 ? 16 : HWY_TARGET == HWY_AVX2 ? 8 : 1;

// Table of 2^(i / kOctaveSteps). Its bits lack i steps' share of the exponent, which scaling by the power adds again.
struct OctaveTable {
    HWY_ALIGN int32_t bits[16] = {};

    OctaveTable()
    {
        for (size_t i = 0; i < kOctaveSteps; ++i)
            bits[i] = std::bit_cast<int32_t>(float(std::exp2(double(i) / kOctaveSteps))) -
                      int32_t(i * ((size_t(1) << 23) / kOctaveSteps));
    }
};

// out[i] = 2^x[i] for x in [-125, 127], with a relative error of 6e-7. Callers mask other arguments, for which the
// result has no meaning.
template <size_t kCount>
HWY_INLINE void exp2Steps(D d, const OctaveTable& octave, const V* x, V* out)
{
    const hn::RebindToSigned<D> di;
    constexpr int kShift = 23 - std::countr_zero(kOctaveSteps);
    const V magic = hn::Set(d, 12582912.0f / kOctaveSteps); // adding it rounds to a whole number of steps
    V shifted[kCount], r[kCount];
    for (size_t i = 0; i < kCount; ++i)
        shifted[i] = hn::Add(x[i], magic);
    for (size_t i = 0; i < kCount; ++i)
        r[i] = hn::Sub(x[i], hn::Sub(shifted[i], magic));
    for (size_t i = 0; i < kCount; ++i) {
        // note: polynomials with the smallest relative error on half a step
        if constexpr (kOctaveSteps == 16) {
            out[i] = hn::MulAdd(hn::Set(d, 0.24021946f), r[i], hn::Set(d, 0.69318783f));
        } else if constexpr (kOctaveSteps == 8) {
            out[i] = hn::MulAdd(hn::Set(d, 0.0554988982f), r[i], hn::Set(d, 0.240264076f));
            out[i] = hn::MulAdd(out[i], r[i], hn::Set(d, 0.693147209f));
        } else {
            const V r2 = hn::Mul(r[i], r[i]);
            const V low = hn::MulAdd(hn::Set(d, 0.240226469f), r[i], hn::Set(d, 0.693147206f));
            const V mid = hn::MulAdd(hn::Set(d, 0.00961848424f), r[i], hn::Set(d, 0.0555032808f));
            const V high = hn::MulAdd(hn::Set(d, 1.53473201e-4f), r[i], hn::Set(d, 0.00134001545f));
            out[i] = hn::MulAdd(hn::MulAdd(high, r2, mid), r2, low);
        }
        out[i] = hn::MulAdd(out[i], r[i], hn::Set(d, 1.0f));
    }
    for (size_t i = 0; i < kCount; ++i) {
        const auto steps = hn::BitCast(di, shifted[i]);
        const auto power = hn::ShiftLeft<kShift>(steps);
        if constexpr (kOctaveSteps == 1) {
            out[i] = hn::BitCast(d, hn::Add(hn::BitCast(di, out[i]), power));
        } else {
#if HWY_IS_DEBUG_BUILD
            const auto step = hn::And(steps, hn::Set(di, int32_t(kOctaveSteps - 1)));
#else
            const auto step = steps; // no masking is needed, since the instruction reads only the low bits
#endif
            const auto scale = hn::TableLookupLanes(hn::Load(di, octave.bits), hn::IndicesFromVec(di, step));
            out[i] = hn::Mul(out[i], hn::BitCast(d, hn::Add(scale, power)));
        }
    }
}

// max(low, v) and min(high, v) that return NaN if v is NaN.
HWY_INLINE V maxKeepNan(D d, float low, V v)
{
#if HWY_ARCH_X86 && HWY_TARGET != HWY_SCALAR
    return hn::Max(hn::Set(d, low), v); // note: on x86 Max returns the second operand if either is NaN
#else
    return hn::IfThenElse(hn::Lt(v, hn::Set(d, low)), hn::Set(d, low), v);
#endif
}

HWY_INLINE V minKeepNan(D d, float high, V v)
{
#if HWY_ARCH_X86 && HWY_TARGET != HWY_SCALAR
    return hn::Min(hn::Set(d, high), v);
#else
    return hn::IfThenElse(hn::Gt(v, hn::Set(d, high)), hn::Set(d, high), v);
#endif
}

HWY_INLINE V clampKeepNan(D d, V x, float low, float high)
{
    return maxKeepNan(d, low, minKeepNan(d, high, x));
}

// exp for every argument: 0 below -87 (also for -inf: format facts, trap 15), inf above 88.7, NaN for NaN.
HWY_INLINE V expAny(D d, V x)
{
    const auto low = hn::Lt(x, hn::Set(d, -87.0f));
    const auto high = hn::Gt(x, hn::Set(d, 88.0f));
    V result = expInRange(d, clampKeepNan(d, x, -87, 88));
    // arguments from 88 on: exp(88) exp(x - 88), which becomes infinite where it should
    if (HWY_UNLIKELY(!hn::AllFalse(d, high))) {
        const V rest = hn::Min(hn::Sub(x, hn::Set(d, 88.0f)), hn::Set(d, 80.0f));
        result = hn::IfThenElse(high, hn::Mul(result, expInRange(d, rest)), result);
    }
    return hn::IfThenZeroElse(low, result);
}

// 1 / v for normal v, with an error of 2 ulp; with AVX-512 it takes a quarter of a division's time.
HWY_INLINE V reciprocal(D d, V v)
{
#if HWY_TARGET <= HWY_AVX3
    const V r = hn::ApproximateReciprocal(v); // estimate with 14 correct bits
    return hn::MulAdd(hn::NegMulAdd(v, r, hn::Set(d, 1.0f)), r, r);
#else
    return hn::Div(hn::Set(d, 1.0f), v);
#endif
}

// 1 / sqrt(v) for normal v, with an error of 2 ulp; with AVX-512 it takes a fifth of a square root and a division.
HWY_INLINE V reciprocalSqrt(D d, V v)
{
#if HWY_TARGET <= HWY_AVX3
    const V r = hn::ApproximateReciprocalSqrt(v); // estimate with 14 correct bits
    const V half = hn::Mul(hn::Mul(v, r), hn::Set(d, -0.5f));
    return hn::MulAdd(hn::MulAdd(half, r, hn::Set(d, 0.5f)), r, r);
#else
    return hn::Div(hn::Set(d, 1.0f), hn::Sqrt(v));
#endif
}

// Sigmoid 1 / (1 + exp(-x)) for every argument, with an error of 3 ulp; NaN for NaN.
HWY_INLINE V sigmoidAny(D d, V x)
{
    const V t = clampKeepNan(d, hn::Neg(x), -80, 80);
    return reciprocal(d, hn::Add(hn::Set(d, 1.0f), expInRange(d, t)));
}

// tanh for every argument, with an error of 3 ulp; NaN for NaN. It uses expm1(2 |x|), so that small arguments keep
// their relative accuracy.
HWY_INLINE V tanhAny(D d, V x)
{
    const V one = hn::Set(d, 1.0f), two = hn::Set(d, 2.0f);
    const V a = clampKeepNan(d, hn::Abs(x), 0, 10); // limited to 10, since tanh(10) rounds to 1
    V shifted;
    const V r = reduceExp(d, hn::Mul(two, a), shifted);
    const V power = scaleByPower(d, one, shifted);
    const V em1 = hn::MulAdd(power, expm1Reduced(d, r), hn::Sub(power, one));
    return hn::CopySign(hn::Div(em1, hn::Add(em1, two)), x);
}

// Natural logarithm of positive normal numbers, with an absolute error of 6e-4: for bounds that have a margin.
HWY_INLINE V roughLog(D d, V x)
{
    const hn::RebindToSigned<D> di;
    const auto bits = hn::BitCast(di, x);
    const V exponent = hn::ConvertTo(d, hn::Sub(hn::ShiftRight<23>(bits), hn::Set(di, 127)));
    const V m = hn::BitCast(d, hn::Or(hn::And(bits, hn::Set(di, 0x7fffff)), hn::Set(di, 0x3f800000)));
    // log(m) on [1, 2): a cubic through Chebyshev nodes
    V p = hn::Set(d, 0.10584377f);
    p = hn::MulAdd(p, m, hn::Set(d, -0.71172693f));
    p = hn::MulAdd(p, m, hn::Set(d, 2.08717856f));
    p = hn::MulAdd(p, m, hn::Set(d, -1.48072323f));
    return hn::MulAdd(exponent, hn::Set(d, 0.69314718f), p);
}

} // namespace HWY_NAMESPACE
} // namespace gsc
HWY_AFTER_NAMESPACE();

#endif
