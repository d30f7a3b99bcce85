// SPDX-License-Identifier: Apache-2.0
// Takes a vector of anchors through the first layers of the networks, which plain decoding and reuse have in common.
// Included once for each SIMD target.

#if defined(GSC_KERNELS_DECODE_BATCH_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef GSC_KERNELS_DECODE_BATCH_INL_H
#undef GSC_KERNELS_DECODE_BATCH_INL_H
#else
#define GSC_KERNELS_DECODE_BATCH_INL_H
#endif

#include "kernels/simd/simd_math-inl.h"
#include "kernels/decode/decode.h"
#include "kernels/decode/dense-inl.h"

#include <hwy/cache_control.h>

#include <algorithm>

HWY_BEFORE_NAMESPACE();
namespace gsc {
namespace HWY_NAMESPACE {

// Scratch for one vector of anchors, in DecodeScratch::values; every row holds kMaxLanes floats.
struct Batch {
    float* feature;  // F rows: features of the anchors
    float* view;     // 5 rows right behind the features: direction (3), distance, level
    float* banked;   // F rows for the features behind the feature bank, and 5 for the view; only with a bank
    float* shared;   // 3 hidden_pad rows: first layer of the features alone, which all eyes share
    float* hidden;   // 3 hidden_pad rows: hidden units of the three heads
    float* opacity;  // out_pad rows: opacities of the slots
    float* offset;   // 3 K rows: offsets of the slots
    float* position; // 3 rows: positions of the anchors
    float* scale;    // 6 rows: exp() of the stored logarithms
    float* level;    // 1 row: levels of the anchors
    uint32_t count;  // number of anchors in the vector
};

HWY_INLINE Batch carve(const ModelParams& params, const PackedMlpHeader& packed, float* values)
{
    Batch batch{};
    const auto take = [&values](size_t rows) {
        float* p = values;
        values += rows * kMaxLanes;
        return p;
    };
    batch.feature = take(params.feat_dim);
    batch.view = take(kViewRows);
    batch.banked = take(params.feat_dim + kViewRows);
    batch.shared = take(size_t(3) * packed.hidden_pad);
    batch.hidden = take(size_t(3) * packed.hidden_pad);
    batch.opacity = take(packed.out_pad[0]);
    batch.offset = take(size_t(3) * params.n_offsets);
    batch.position = take(3);
    batch.scale = take(6);
    batch.level = take(1);
    return batch;
}

// Transposes `width` values of `count` anchors: rows[j][lane] = source[lane][j]. Lanes without an anchor repeat the
// last.
HWY_INLINE void transpose(const float* const* source, uint32_t width, float* rows)
{
    const uint32_t lanes = uint32_t(hn::Lanes(D()));
    uint32_t first = 0; // first column that is left to the scalar loop
#if HWY_TARGET != HWY_SCALAR
    const hn::FixedTag<float, 4> d4;
    first = width / 4 * 4;
    for (uint32_t lane = 0; lane < lanes; lane += 4) {
        const float *p0 = source[lane], *p1 = source[lane + 1], *p2 = source[lane + 2], *p3 = source[lane + 3];
        for (uint32_t j = 0; j < first; j += 4) {
            const auto a = hn::LoadU(d4, p0 + j), b = hn::LoadU(d4, p1 + j);
            const auto c = hn::LoadU(d4, p2 + j), e = hn::LoadU(d4, p3 + j);
            const auto ab_low = hn::InterleaveLower(d4, a, b), ab_high = hn::InterleaveUpper(d4, a, b);
            const auto ce_low = hn::InterleaveLower(d4, c, e), ce_high = hn::InterleaveUpper(d4, c, e);
            float* to = rows + size_t(j) * kMaxLanes + lane;
            hn::Store(hn::ConcatLowerLower(d4, ce_low, ab_low), d4, to);
            hn::Store(hn::ConcatUpperUpper(d4, ce_low, ab_low), d4, to + kMaxLanes);
            hn::Store(hn::ConcatLowerLower(d4, ce_high, ab_high), d4, to + 2 * kMaxLanes);
            hn::Store(hn::ConcatUpperUpper(d4, ce_high, ab_high), d4, to + 3 * kMaxLanes);
        }
    }
#endif
    for (uint32_t j = first; j < width; ++j)
        for (uint32_t lane = 0; lane < lanes; ++lane)
            rows[size_t(j) * kMaxLanes + lane] = source[lane][j];
}

// Prefetches what gather() will read of the next anchors, which lie in memory order but with gaps.
HWY_INLINE void prefetch(const ModelView& model, const VisibleAnchor* visible, uint32_t count)
{
    constexpr size_t kLine = 64;
    const size_t feature_bytes = sizeof(float) * model.params->feat_dim;
    const size_t offset_bytes = sizeof(float) * 3 * model.params->n_offsets;
    const auto ask = [](const float* values, size_t bytes) {
        const char* p = reinterpret_cast<const char*>(values);
        for (size_t i = 0; i < bytes; i += kLine)
            hwy::Prefetch(p + i);
        hwy::Prefetch(p + bytes - 1);
    };
    for (uint32_t i = 0; i < count; ++i) {
        const VisibleAnchor& anchor = visible[i];
        const ChunkArrays& arrays = model.arrays[anchor.chunk];
        ask(arrays.feature + model.params->feat_dim * size_t(anchor.local), feature_bytes);
        ask(arrays.offset + 3 * model.params->n_offsets * size_t(anchor.local), offset_bytes);
        hwy::Prefetch(arrays.scale + 6 * size_t(anchor.local));
    }
}

HWY_INLINE void gather(const ModelView& model, const VisibleAnchor* visible, Batch& batch)
{
    const D d;
    const uint32_t lanes = uint32_t(hn::Lanes(d)), F = model.params->feat_dim, K = model.params->n_offsets;
    const float *feature[kMaxLanes], *offset[kMaxLanes], *scale[kMaxLanes];
    for (uint32_t lane = 0; lane < lanes; ++lane) {
        const VisibleAnchor& anchor = visible[std::min(lane, batch.count - 1)];
        const ChunkArrays& arrays = model.arrays[anchor.chunk];
        feature[lane] = arrays.feature + size_t(F) * anchor.local;
        offset[lane] = arrays.offset + size_t(3) * K * anchor.local;
        scale[lane] = arrays.scale + size_t(6) * anchor.local;
        const Vec3<float> p = anchorPosition(model, anchor.chunk, anchor.local);
        batch.position[lane] = p.x;
        batch.position[kMaxLanes + lane] = p.y;
        batch.position[2 * kMaxLanes + lane] = p.z;
        batch.level[lane] = float(anchorLevel(model, anchor.chunk));
    }
    transpose(feature, F, batch.feature);
    transpose(offset, 3 * K, batch.offset);
    transpose(scale, 6, batch.scale);
    for (int i = 0; i < 6; ++i)
        hn::Store(expAny(d, hn::Load(d, batch.scale + i * kMaxLanes)), d, batch.scale + i * kMaxLanes);
}

// Computes the rows of direction, distance and level for an eye (format facts 4.1).
HWY_INLINE void viewRows(const Batch& batch, const float* center, float* view)
{
    const D d;
    V v[3];
    for (int i = 0; i < 3; ++i)
        v[i] = hn::Sub(hn::Load(d, batch.position + i * kMaxLanes), hn::Set(d, center[i]));
    const V distance = hn::Sqrt(hn::Add(hn::Add(hn::Mul(v[0], v[0]), hn::Mul(v[1], v[1])), hn::Mul(v[2], v[2])));
    for (int i = 0; i < 3; ++i)
        hn::Store(hn::Div(v[i], distance), d, view + i * kMaxLanes);
    hn::Store(distance, d, view + 3 * kMaxLanes);
    hn::Store(hn::Load(d, batch.level), d, view + 4 * kMaxLanes);
}

// Passes features through the feature bank into batch.banked, with the weights of MLPW: 128 multiply-adds and a
// softmax.
HWY_INLINE void applyBank(const DecodeArgs& args, const Batch& batch)
{
    const D d;
    const ModelParams& params = *args.model->params;
    const MlpRecord& bank = *args.bank;
    const uint32_t F = params.feat_dim;
    const float* w0 = mlpWeights(*args.model, bank.weight0);
    const float* b0 = mlpWeights(*args.model, bank.bias0);
    const float* w1 = mlpWeights(*args.model, bank.weight1);
    const float* b1 = mlpWeights(*args.model, bank.bias1);
    const float* rows[kViewRows] = {batch.view, batch.view + kMaxLanes, batch.view + 2 * kMaxLanes};
    uint32_t used = 3;
    if (bank.inputs & kMlpTakesDistance)
        rows[used++] = batch.view + 3 * kMaxLanes;
    if (bank.inputs & kMlpTakesLevel)
        rows[used++] = batch.view + 4 * kMaxLanes;
    V out[3] = {hn::Set(d, b1[0]), hn::Set(d, b1[1]), hn::Set(d, b1[2])};
    for (uint32_t h = 0; h < bank.hidden; ++h) {
        V sum = hn::Set(d, b0[h]);
        for (uint32_t i = 0; i < used; ++i)
            sum = hn::MulAdd(hn::Set(d, w0[size_t(h) * bank.in + i]), hn::Load(d, rows[i]), sum);
        sum = rectify(d, sum);
        for (int o = 0; o < 3; ++o)
            out[o] = hn::MulAdd(hn::Set(d, w1[size_t(o) * bank.hidden + h]), sum, out[o]);
    }
    const V top = hn::Max(out[0], hn::Max(out[1], out[2]));
    V total = hn::Zero(d);
    for (V& o : out) {
        o = expAny(d, hn::Sub(o, top));
        total = hn::Add(total, o);
    }
    for (V& o : out)
        o = hn::Div(o, total);
    const auto row = [&](uint32_t j) { return hn::Load(d, batch.feature + size_t(j) * kMaxLanes); };
    for (uint32_t j = 0; j < F; ++j) {
        const V sum = hn::Add(hn::Mul(row(4 * (j % (F / 4))), out[0]), hn::Mul(row(2 * (j % (F / 2))), out[1]));
        hn::Store(hn::MulAdd(row(j), out[2], sum), d, batch.banked + size_t(j) * kMaxLanes);
    }
    std::copy_n(batch.view, kViewRows * kMaxLanes, batch.banked + size_t(F) * kMaxLanes);
}

// Computes the first layers of all heads, and the outputs of the opacity head, for an eye at `center`; writes
// batch.hidden and batch.opacity. With more than one eye, the part of the features is read from batch.shared
// (sharedLayer()).
HWY_INLINE void hiddenLayers(const DecodeArgs& args, const PackedMlpHeader& packed, const float* center,
                             const Batch& batch)
{
    const D d;
    const ModelView& model = *args.model;
    const uint32_t F = model.params->feat_dim, K = model.params->n_offsets, H = packed.hidden_pad;
    viewRows(batch, center, batch.view);
    const float* first = packedWeights(model, packed.first_f32);
    const uint32_t view_rows = args.takes_level ? 5 : (args.takes_distance ? 4 : 3);
    if (args.bank != nullptr) {
        applyBank(args, batch);
        dense(d, batch.banked, F + view_rows, first, 3 * H, args.first_bias, nullptr, 3 * H, true, batch.hidden);
    } else if (args.eye_count > 1) {
        dense(d, batch.view, view_rows, first + size_t(F) * 3 * H, 3 * H, nullptr, batch.shared, 3 * H, true,
              batch.hidden);
    } else {
        dense(d, batch.feature, F + view_rows, first, 3 * H, args.first_bias, nullptr, 3 * H, true, batch.hidden);
    }
    dense(d, batch.hidden, H, packedWeights(model, packed.second_f32[0]), packed.out_pad[0],
          packedWeights(model, packed.second_bias_f32[0]), nullptr, K, false, batch.opacity);
}

// Computes the part of the first layer that is equal for all eyes.
HWY_INLINE void sharedLayer(const DecodeArgs& args, const PackedMlpHeader& packed, const Batch& batch)
{
    const uint32_t H = packed.hidden_pad;
    if (args.eye_count > 1 && args.bank == nullptr)
        dense(D(), batch.feature, args.model->params->feat_dim, packedWeights(*args.model, packed.first_f32), 3 * H,
              args.first_bias, nullptr, 3 * H, false, batch.shared);
}

} // namespace HWY_NAMESPACE
} // namespace gsc
HWY_AFTER_NAMESPACE();

#endif
