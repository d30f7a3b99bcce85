// SPDX-License-Identifier: Apache-2.0
// Dense layers of networks for a vector of anchors, with the packed weights. Included once for each SIMD target.

#if defined(GSC_KERNELS_DENSE_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef GSC_KERNELS_DENSE_INL_H
#undef GSC_KERNELS_DENSE_INL_H
#else
#define GSC_KERNELS_DENSE_INL_H
#endif

#include "kernels/simd/simd_math-inl.h"
#include "kernels/decode/decode.h"

#include <utility>

HWY_BEFORE_NAMESPACE();
namespace gsc {
namespace HWY_NAMESPACE {

constexpr size_t kCovariancePerOffset = 7;
constexpr size_t kColorPerOffset = 3;

// Outputs whose sums are held in registers at once: 24 of 32 registers with AVX-512, 12 of 16 without. Both numbers
// divide 48, and the fused first layer has a multiple of 48 outputs.
constexpr size_t kColumns = HWY_TARGET <= HWY_AVX3 ? 24 : 12;

// max(v, 0) that keeps NaN, as the trainers' ReLU does (format facts, trap 18).
HWY_INLINE V rectify(D d, V v)
{
    return maxKeepNan(d, 0, v);
}

template <size_t... I>
HWY_INLINE void denseColumns(D d, std::index_sequence<I...>, const float* x, uint32_t rows, const float* w,
                             size_t stride, const float* bias, const float* start, bool relu, float* out)
{
    V sum[] = {(bias != nullptr ? hn::Set(d, bias[I]) : hn::Load(d, start + I * kMaxLanes))...};
    for (uint32_t i = 0; i < rows; ++i) {
        const V v = hn::Load(d, x + size_t(i) * kMaxLanes);
        ((sum[I] = hn::MulAdd(hn::Set(d, w[I]), v, sum[I])), ...);
        w += stride;
    }
    if (relu)
        (hn::Store(rectify(d, sum[I]), d, out + I * kMaxLanes), ...);
    else
        (hn::Store(sum[I], d, out + I * kMaxLanes), ...);
}

// Computes out[c] = start[c] + sum over rows of w[row][c] x[row] for `columns` columns, rounded up to a multiple of 4
// (the weights are padded to 16). The sums start from `bias`, a number per column, or from a vector per column.
HWY_INLINE void dense(D d, const float* x, uint32_t rows, const float* w, size_t stride, const float* bias,
                      const float* start, uint32_t columns, bool relu, float* out)
{
    uint32_t c = 0;
    const auto block = [&](auto sequence) {
        denseColumns(d, sequence, x, rows, w + c, stride, bias != nullptr ? bias + c : nullptr,
                     start != nullptr ? start + size_t(c) * kMaxLanes : nullptr, relu, out + size_t(c) * kMaxLanes);
        c += uint32_t(sequence.size());
    };
    while (c < columns) {
        const uint32_t left = columns - c;
        if (left >= kColumns)
            block(std::make_index_sequence<kColumns>());
        else if (left > 8)
            block(std::make_index_sequence<12>());
        else if (left > 4)
            block(std::make_index_sequence<8>());
        else
            block(std::make_index_sequence<4>());
    }
}

// Computes the second layers of the covariance and colour heads for Gaussian k: 7 and 3 sums.
HWY_INLINE void offsetHeads(D d, const ModelView& model, const PackedMlpHeader& packed, const float* covariance_hidden,
                            const float* color_hidden, uint32_t k, V* out)
{
    const size_t covariance_column = kCovariancePerOffset * k, color_column = kColorPerOffset * k;
    const float* w = packedWeights(model, packed.second_f32[1]) + covariance_column;
    const float* u = packedWeights(model, packed.second_f32[2]) + color_column;
    const float* b = packedWeights(model, packed.second_bias_f32[1]) + covariance_column;
    const float* c = packedWeights(model, packed.second_bias_f32[2]) + color_column;
    V s0 = hn::Set(d, b[0]), s1 = hn::Set(d, b[1]), s2 = hn::Set(d, b[2]), s3 = hn::Set(d, b[3]);
    V s4 = hn::Set(d, b[4]), s5 = hn::Set(d, b[5]), s6 = hn::Set(d, b[6]);
    V t0 = hn::Set(d, c[0]), t1 = hn::Set(d, c[1]), t2 = hn::Set(d, c[2]);
    for (uint32_t h = 0; h < packed.hidden_pad; ++h) {
        const V x = hn::Load(d, covariance_hidden + size_t(h) * kMaxLanes);
        const V y = hn::Load(d, color_hidden + size_t(h) * kMaxLanes);
        s0 = hn::MulAdd(hn::Set(d, w[0]), x, s0);
        s1 = hn::MulAdd(hn::Set(d, w[1]), x, s1);
        s2 = hn::MulAdd(hn::Set(d, w[2]), x, s2);
        s3 = hn::MulAdd(hn::Set(d, w[3]), x, s3);
        s4 = hn::MulAdd(hn::Set(d, w[4]), x, s4);
        s5 = hn::MulAdd(hn::Set(d, w[5]), x, s5);
        s6 = hn::MulAdd(hn::Set(d, w[6]), x, s6);
        t0 = hn::MulAdd(hn::Set(d, u[0]), y, t0);
        t1 = hn::MulAdd(hn::Set(d, u[1]), y, t1);
        t2 = hn::MulAdd(hn::Set(d, u[2]), y, t2);
        w += packed.out_pad[1];
        u += packed.out_pad[2];
    }
    const V all[] = {s0, s1, s2, s3, s4, s5, s6, t0, t1, t2};
    for (size_t i = 0; i < kCovariancePerOffset + kColorPerOffset; ++i)
        out[i] = all[i];
}

} // namespace HWY_NAMESPACE
} // namespace gsc
HWY_AFTER_NAMESPACE();

#endif
