// SPDX-License-Identifier: Apache-2.0
// Computes sensitivities with an anchor in each lane, as decode does. The direction of a probe is the same for every
// anchor. So its part of the first layer is one number for each column, as is the derivative of that part, and only the
// second layer is computed for each direction: once for the values, and once for each tangent, through the mask of the
// ReLU.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/sensitivity/sensitivity_cpu.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "kernels/simd/simd_math-inl.h"
#include "kernels/decode/decode.h"
#include "kernels/decode/dense-inl.h"
#include "kernels/sensitivity/sensitivity.h"

#include <algorithm>
#include <cmath>
#include <utility>

#ifndef GSC_KERNELS_SENSITIVITY_CPU_ONCE
#define GSC_KERNELS_SENSITIVITY_CPU_ONCE
namespace gsc {

// Values for one call that do not depend on the anchor.
struct SensitivityTable {
    const ModelView* model;
    const MlpRecord* bank_mlp;                    // network of the feature bank, null if there is none
    uint32_t tangents;                            // number of tangents: 1, or 2 if a network takes the distance
    const float* zero;                            // 3 hidden_pad zeros, from which sums start
    const float* base[kProbes];                   // 3 hidden_pad values: bias and the probe's part of the first layer
    const float* slope[kProbes][kProbeTangents];  // 3 hidden_pad values: derivative of `base` along each tangent
    float bank[kProbes][3];                       // weights of the feature bank at each probe
    float bank_slope[kProbes][kProbeTangents][3]; // derivatives of the feature bank's weights along each tangent
    float* rows;                                  // scratch for one vector of anchors
};

} // namespace gsc
#endif

HWY_BEFORE_NAMESPACE();
namespace gsc {
namespace HWY_NAMESPACE {

using M = hn::Mask<D>;

// Scratch for one vector of anchors; every row holds kMaxLanes floats. Where there are several, index 0 is for values
// and the others for tangents.
struct Rows {
    float* feature;                     // F rows: features of the anchors
    float* scale;                       // 3 rows: base sizes of the Gaussians, relative to the longest axis
    float* banked;                      // F rows: features behind the feature bank, if there is one
    float* first[1 + kProbeTangents];   // 3 hidden_pad rows before the ReLU; those of tangents only with a feature bank
    float* hidden[1 + kProbeTangents];  // 3 hidden_pad rows behind the ReLU
    float* opacity[1 + kProbeTangents]; // out_pad rows: outputs of the opacity head
    uint16_t* active[3]; // for each head, up to hidden_pad numbers of hidden units that are not 0 for some anchor
    uint32_t active_count[3];
};

Rows carveRows(const ModelParams& params, const PackedMlpHeader& packed, float* values)
{
    Rows rows{};
    const auto take = [&values](size_t count) {
        float* p = values;
        values += count * kMaxLanes;
        return p;
    };
    rows.feature = take(params.feat_dim);
    rows.scale = take(3);
    rows.banked = take(params.feat_dim);
    for (uint32_t t = 0; t <= kProbeTangents; ++t) {
        rows.first[t] = take(size_t(3) * packed.hidden_pad);
        rows.hidden[t] = take(size_t(3) * packed.hidden_pad);
        rows.opacity[t] = take(packed.out_pad[0]);
    }
    for (uint16_t*& active : rows.active) {
        active = reinterpret_cast<uint16_t*>(values);
        values += packed.hidden_pad;
    }
    return rows;
}

// Computes sum[source][out] += w[unit][out] x[source][unit] over the hidden units that are not 0 for some anchor.
template <size_t kOut, size_t... I>
HWY_INLINE void sumUnits(std::index_sequence<I...>, const Rows& rows, uint32_t head, const float* const* x,
                         const float* w, size_t stride, V* sum)
{
    constexpr size_t kSources = sizeof...(I) / kOut;
    const D d;
    V s[] = {sum[I]...};
    const uint16_t* active = rows.active[head];
    for (uint32_t i = 0; i < rows.active_count[head]; ++i) {
        const size_t unit = active[i];
        const float* weight = w + unit * stride;
        V v[kSources];
        for (size_t k = 0; k < kSources; ++k)
            v[k] = hn::Load(d, x[k] + unit * kMaxLanes);
        ((s[I] = hn::MulAdd(hn::Set(d, weight[I % kOut]), v[I / kOut], s[I])), ...);
    }
    ((sum[I] = s[I]), ...);
}

// Computes kOut columns of a head's second layer, from `column` on, for the values (with the bias) and for every
// tangent (without): out[source * kOut + i].
template <size_t kOut>
HWY_INLINE void secondLayer(const SensitivityTable& table, const PackedMlpHeader& packed, const Rows& rows,
                            uint32_t head, size_t column, V* out)
{
    const D d;
    const float* w = packedWeights(*table.model, packed.second_f32[head]) + column;
    const float* bias = packedWeights(*table.model, packed.second_bias_f32[head]) + column;
    const uint32_t sources = 1 + table.tangents;
    const float* x[1 + kProbeTangents];
    for (uint32_t s = 0; s < sources; ++s) {
        x[s] = rows.hidden[s] + size_t(head) * packed.hidden_pad * kMaxLanes;
        for (size_t i = 0; i < kOut; ++i)
            out[s * kOut + i] = s == 0 ? hn::Set(d, bias[i]) : hn::Zero(d);
    }
    const size_t stride = packed.out_pad[head];
    // with 32 registers all sums fit at once, so that weights are loaded once
    if (HWY_TARGET <= HWY_AVX3 && sources == 2)
        sumUnits<kOut>(std::make_index_sequence<2 * kOut>(), rows, head, x, w, stride, out);
    else if (HWY_TARGET <= HWY_AVX3)
        sumUnits<kOut>(std::make_index_sequence<3 * kOut>(), rows, head, x, w, stride, out);
    else
        for (uint32_t s = 0; s < sources; ++s)
            sumUnits<kOut>(std::make_index_sequence<kOut>(), rows, head, x + s, w, stride, out + s * kOut);
}

// Computes 1 / v[i] for three values with one division. The product of the three must be a normal number. Here and
// below it divides exactly, without estimates, since those differ between CPUs and the result is written to a file.
HWY_INLINE void reciprocals(const V* v, V* out)
{
    const D d;
    const V v01 = hn::Mul(v[0], v[1]);
    const V all = hn::Div(hn::Set(d, 1.0f), hn::Mul(v01, v[2]));
    out[0] = hn::Mul(all, hn::Mul(v[1], v[2]));
    out[1] = hn::Mul(all, hn::Mul(v[0], v[2]));
    out[2] = hn::Mul(all, v01);
}

// Computes the sigmoids of three values, and 1 - sigmoid. Arguments are limited to 28, where a sigmoid is 0 or 1 in
// fp32, so that three of them have a product.
HWY_INLINE void sigmoids(const V* x, V* value, V* rest)
{
    const D d;
    V e[3], sum[3];
    for (int i = 0; i < 3; ++i) {
        e[i] = expInRange(d, clampKeepNan(d, hn::Neg(x[i]), -28, 28));
        sum[i] = hn::Add(hn::Set(d, 1.0f), e[i]);
    }
    reciprocals(sum, value);
    for (int i = 0; i < 3; ++i)
        rest[i] = hn::Mul(e[i], value[i]);
}

// Factors in the relative change of a Gaussian's covariance that do not depend on the tangent.
struct Shape {
    V log_slope[3]; // d ln(s_i^2) / 2 per change of the network's output, multiplied by s_i^2 / r_i
    V turn[3];      // factor of the square of the turn round axis i
    // note: explicit, so that it has the attributes of the SIMD target; GCC for Arm does not give them to an implicit
    // one
    HWY_INLINE Shape() {}
};

// Computes Shape for M = R diag(s^2) R^T, with s_i = scale_i sigmoid(z_i) and R the rotation of the quaternion q. In
// the frame of R, dM has 2 s_i^2 d ln s_i on its diagonal and w_k (s_i^2 - s_j^2) off it, where w is the angular
// velocity; r_i = s_i^2 + (kThinAxis s_max)^2.
HWY_INLINE Shape shapeOf(const Rows& rows, const V* head)
{
    const D d;
    const V one = hn::Set(d, 1.0f);
    V sigmoid[3], rest[3], s[3], n[3], r[3], inverse[3];
    sigmoids(head, sigmoid, rest);
    for (int i = 0; i < 3; ++i)
        s[i] = hn::Mul(hn::Load(d, rows.scale + i * kMaxLanes), sigmoid[i]);
    const V longest = hn::Max(hn::Max(s[0], s[1]), hn::Max(s[2], hn::Set(d, 1e-30f)));
    const V scale = hn::Div(one, longest);
    for (int i = 0; i < 3; ++i) {
        const V u = hn::Mul(s[i], scale);
        n[i] = hn::Mul(u, u);
        r[i] = hn::Add(n[i], hn::Set(d, float(kThinAxis * kThinAxis)));
    }
    reciprocals(r, inverse);
    V norm = hn::Mul(head[3], head[3]);
    for (int i = 4; i < 7; ++i)
        norm = hn::MulAdd(head[i], head[i], norm);
    // note: below 1e-12 a quaternion counts as zero (format facts 4.4)
    norm = maxKeepNan(d, 1e-18f, norm);
    const V inverse_norm = hn::Div(one, norm);
    const V turned = hn::Mul(hn::Set(d, 2.0f), hn::Mul(inverse_norm, inverse_norm));
    Shape shape;
    for (int i = 0; i < 3; ++i) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        shape.log_slope[i] = hn::Mul(hn::Mul(n[i], inverse[i]), rest[i]);
        const V gap = hn::Sub(n[j], n[k]);
        shape.turn[i] = hn::Mul(hn::Mul(hn::Mul(gap, gap), hn::Mul(inverse[j], inverse[k])), turned);
    }
    return shape;
}

// S^2 along a tangent, whose derivatives of the outputs are `slope`.
HWY_INLINE V shapeChange(const Shape& shape, const V* head, const V* slope)
{
    V sum = hn::Zero(D());
    for (int i = 0; i < 3; ++i) {
        const V log_change = hn::Mul(shape.log_slope[i], slope[i]);
        sum = hn::MulAdd(log_change, log_change, sum);
    }
    // half the angular velocity times |q|^2: the vector part of conj(q) dq
    const V *q = head + 3, *dq = slope + 3;
    for (int i = 0; i < 3; ++i) {
        const int j = 1 + (i + 1) % 3, k = 1 + (i + 2) % 3;
        V turn = hn::Mul(q[0], dq[1 + i]);
        turn = hn::NegMulAdd(dq[0], q[1 + i], turn);
        turn = hn::NegMulAdd(q[j], dq[k], turn);
        turn = hn::MulAdd(q[k], dq[j], turn);
        sum = hn::MulAdd(hn::Mul(turn, turn), shape.turn[i], sum);
    }
    return sum;
}

// Adds Gaussian k at a probe to the sums of squares, and to `living` in each lane where it has an opacity.
HWY_INLINE void probeOffset(const SensitivityTable& table, const PackedMlpHeader& packed, const Rows& rows, uint32_t k,
                            V& living, V& direction_sum, V& distance_sum)
{
    const D d;
    const V opacity = tanhAny(d, hn::Load(d, rows.opacity[0] + size_t(k) * kMaxLanes));
    const V opacity_slope = hn::NegMulAdd(opacity, opacity, hn::Set(d, 1.0f));
    const M dead = hn::Lt(opacity, hn::Set(d, kOpacityFloor)); // note: false for NaN, which counts as alive
    if (hn::AllTrue(d, dead))
        return;
    V covariance[kCovariancePerOffset * (1 + kProbeTangents)], raw_color[kColorPerOffset * (1 + kProbeTangents)];
    secondLayer<kCovariancePerOffset>(table, packed, rows, 1, kCovariancePerOffset * k, covariance);
    secondLayer<kColorPerOffset>(table, packed, rows, 2, kColorPerOffset * k, raw_color);
    V color[3], color_slope[3];
    const Shape shape = shapeOf(rows, covariance);
    sigmoids(raw_color, color, color_slope);
    for (int c = 0; c < 3; ++c)
        color_slope[c] = hn::Mul(color_slope[c], color[c]);
    const V opacity_weight = hn::Set(d, float(kSensitivityWeights.opacity * kSensitivityWeights.opacity));
    const V scale_weight =
        hn::Mul(hn::Mul(opacity, opacity), hn::Set(d, float(kSensitivityWeights.scale * kSensitivityWeights.scale)));
    V direction = hn::Zero(d), distance = hn::Zero(d);
    for (uint32_t t = 0; t < table.tangents; ++t) {
        const V* color_step = raw_color + kColorPerOffset * (1 + t);
        const V d_opacity = hn::Mul(opacity_slope, hn::Load(d, rows.opacity[1 + t] + size_t(k) * kMaxLanes));
        V change = hn::Zero(d);
        for (int c = 0; c < 3; ++c) {
            const V d_color = hn::Mul(color_slope[c], color_step[c]);
            const V drawn = hn::MulAdd(d_opacity, color[c], hn::Mul(opacity, d_color));
            change = hn::Max(change, hn::Mul(drawn, drawn));
        }
        // note: adds NaN if a colour is NaN, since Max may lose that
        change = hn::Add(change, hn::Mul(hn::Zero(d), hn::Add(color[0], hn::Add(color[1], color[2]))));
        change = hn::MulAdd(hn::Mul(d_opacity, d_opacity), opacity_weight, change);
        change = hn::MulAdd(shapeChange(shape, covariance, covariance + kCovariancePerOffset * (1 + t)), scale_weight,
                            change);
        if (t == 0)
            direction = hn::Add(change, change);
        else
            distance = change;
    }
    const V infinity = hn::Inf(d);
    const auto add = [&](V& sum, V value) {
        value = hn::IfThenElse(hn::Eq(value, value), value, infinity);
        sum = hn::Add(sum, hn::IfThenZeroElse(dead, value));
    };
    add(direction_sum, direction);
    add(distance_sum, distance);
    living = hn::Add(living, hn::IfThenZeroElse(dead, hn::Set(d, 1.0f)));
}

// Passes the features through the feature bank into rows.banked; its weights w are the same for every anchor.
HWY_INLINE void bankRows(const Rows& rows, uint32_t F, const float* w)
{
    const D d;
    const V w0 = hn::Set(d, w[0]), w1 = hn::Set(d, w[1]), w2 = hn::Set(d, w[2]);
    const auto row = [&](uint32_t j) { return hn::Load(d, rows.feature + size_t(j) * kMaxLanes); };
    for (uint32_t j = 0; j < F; ++j) {
        const V sum = hn::MulAdd(row(4 * (j % (F / 4))), w0, hn::Mul(row(2 * (j % (F / 2))), w1));
        hn::Store(hn::MulAdd(row(j), w2, sum), d, rows.banked + size_t(j) * kMaxLanes);
    }
}

// Computes the first layer at a probe, values and tangents, behind the ReLU, into rows.hidden.
void probeHidden(const SensitivityTable& table, const PackedMlpHeader& packed, uint32_t probe, Rows& rows)
{
    const D d;
    const uint32_t F = table.model->params->feat_dim, columns = 3 * packed.hidden_pad;
    const float* weights = packedWeights(*table.model, packed.first_f32);
    const bool bank = table.bank_mlp != nullptr;
    if (bank) {
        bankRows(rows, F, table.bank[probe]);
        dense(d, rows.banked, F, weights, columns, table.zero, nullptr, columns, false, rows.first[0]);
        for (uint32_t t = 0; t < table.tangents; ++t) {
            bankRows(rows, F, table.bank_slope[probe][t]);
            dense(d, rows.banked, F, weights, columns, table.zero, nullptr, columns, false, rows.first[1 + t]);
        }
    }
    std::fill_n(rows.active_count, 3, 0u);
    for (uint32_t c = 0; c < columns; ++c) {
        const size_t at = size_t(c) * kMaxLanes;
        const V sum = hn::Add(hn::Load(d, rows.first[0] + at), hn::Set(d, table.base[probe][c]));
        const M on = hn::Gt(sum, hn::Zero(d));
        const V value = rectify(d, sum);
        if (hn::AllTrue(d, hn::Eq(value, hn::Zero(d))))
            continue;
        const uint32_t head = c / packed.hidden_pad;
        rows.active[head][rows.active_count[head]++] = uint16_t(c % packed.hidden_pad);
        hn::Store(value, d, rows.hidden[0] + at);
        for (uint32_t t = 0; t < table.tangents; ++t) {
            V slope = hn::Set(d, table.slope[probe][t][c]);
            if (bank)
                slope = hn::Add(slope, hn::Load(d, rows.first[1 + t] + at));
            hn::Store(hn::IfThenElseZero(on, slope), d, rows.hidden[1 + t] + at);
        }
    }
}

// Computes the second layer of the opacity head, values and tangents, into rows.opacity.
void probeOpacity(const SensitivityTable& table, const PackedMlpHeader& packed, const Rows& rows)
{
    constexpr uint32_t kAtOnce = 4; // divides the number of columns, since weights are padded to 16
    const D d;
    for (uint32_t k = 0; k < table.model->params->n_offsets; k += kAtOnce) {
        V out[kAtOnce * (1 + kProbeTangents)];
        secondLayer<kAtOnce>(table, packed, rows, 0, k, out);
        for (uint32_t s = 0; s <= table.tangents; ++s)
            for (uint32_t i = 0; i < kAtOnce; ++i)
                hn::Store(out[s * kAtOnce + i], d, rows.opacity[s] + size_t(k + i) * kMaxLanes);
    }
}

void sensitivityBlock(const SensitivityTable& table, uint32_t chunk, uint32_t first, uint32_t count, float* direction,
                      float* distance)
{
    const D d;
    const ModelView& model = *table.model;
    const PackedMlpHeader& packed = *reinterpret_cast<const PackedMlpHeader*>(model.packed);
    const ChunkArrays& arrays = model.arrays[chunk];
    const uint32_t lanes = uint32_t(hn::Lanes(d)), F = model.params->feat_dim, K = model.params->n_offsets;
    const uint32_t columns = 3 * packed.hidden_pad;
    Rows rows = carveRows(*model.params, packed, table.rows);
    for (uint32_t done = 0; done < count; done += lanes) {
        for (uint32_t lane = 0; lane < lanes; ++lane) {
            const size_t anchor = first + std::min(done + lane, count - 1); // lanes without an anchor repeat the last
            for (uint32_t j = 0; j < F; ++j)
                rows.feature[size_t(j) * kMaxLanes + lane] = arrays.feature[anchor * F + j];
            for (uint32_t i = 0; i < 3; ++i)
                rows.scale[i * kMaxLanes + lane] = arrays.scale[anchor * 6 + 3 + i];
        }
        // scales relative to the longest axis, since only ratios count; axes of size 0 stay 0
        const auto log_scale = [&](uint32_t i) { return hn::Load(d, rows.scale + i * kMaxLanes); };
        const V longest = hn::Max(hn::Max(log_scale(0), log_scale(1)), hn::Max(log_scale(2), hn::Set(d, -1e30f)));
        for (uint32_t i = 0; i < 3; ++i)
            hn::Store(expAny(d, hn::Sub(log_scale(i), longest)), d, rows.scale + i * kMaxLanes);
        if (table.bank_mlp == nullptr)
            dense(d, rows.feature, F, packedWeights(model, packed.first_f32), columns, table.zero, nullptr, columns,
                  false, rows.first[0]);
        V best_direction = hn::Zero(d), best_distance = hn::Zero(d);
        for (uint32_t probe = 0; probe < kProbes; ++probe) {
            probeHidden(table, packed, probe, rows);
            probeOpacity(table, packed, rows);
            V living = hn::Zero(d), direction_sum = hn::Zero(d), distance_sum = hn::Zero(d);
            for (uint32_t k = probe % kOffsetStep; k < K; k += kOffsetStep)
                probeOffset(table, packed, rows, k, living, direction_sum, distance_sum);
            const V share = hn::Div(hn::Set(d, 1.0f), hn::Max(living, hn::Set(d, 1.0f)));
            best_direction = hn::Max(best_direction, hn::Mul(direction_sum, share));
            best_distance = hn::Max(best_distance, hn::Mul(distance_sum, share));
        }
        HWY_ALIGN float result[2][kMaxLanes];
        hn::Store(hn::Sqrt(best_direction), d, result[0]);
        hn::Store(hn::Sqrt(best_distance), d, result[1]);
        const uint32_t used = std::min(lanes, count - done);
        std::copy_n(result[0], used, direction + done);
        std::copy_n(result[1], used, distance + done);
    }
}

} // namespace HWY_NAMESPACE
} // namespace gsc
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gsc {

HWY_EXPORT(sensitivityBlock);

namespace {

// Computes the weights of the feature bank at a probe, and their derivatives along its tangents.
void bankAtProbe(const ModelView& model, const MlpRecord& bank, const SensitivityProbe& probe, double level,
                 uint32_t tangents, float* weights, float (*slopes)[3])
{
    double input[5], step[kProbeTangents][5] = {};
    uint32_t n = 0;
    for (; n < 3; ++n) {
        input[n] = probe.direction[n];
        step[0][n] = probe.tangent[n];
    }
    if (bank.inputs & kMlpTakesDistance) {
        input[n] = probe.distance;
        step[1][n++] = probe.distance; // derivative of the distance by its logarithm
    }
    if (bank.inputs & kMlpTakesLevel)
        input[n++] = level;
    const float *w0 = mlpWeights(model, bank.weight0), *b0 = mlpWeights(model, bank.bias0);
    const float *w1 = mlpWeights(model, bank.weight1), *b1 = mlpWeights(model, bank.bias1);
    double out[3] = {b1[0], b1[1], b1[2]}, slope[kProbeTangents][3] = {};
    for (uint32_t h = 0; h < bank.hidden; ++h) {
        double sum = b0[h], sum_slope[kProbeTangents] = {};
        for (uint32_t i = 0; i < n; ++i) {
            sum += double(w0[size_t(h) * n + i]) * input[i];
            for (uint32_t t = 0; t < tangents; ++t)
                sum_slope[t] += double(w0[size_t(h) * n + i]) * step[t][i];
        }
        if (sum <= 0)
            continue;
        for (uint32_t o = 0; o < 3; ++o) {
            out[o] += double(w1[size_t(o) * bank.hidden + h]) * sum;
            for (uint32_t t = 0; t < tangents; ++t)
                slope[t][o] += double(w1[size_t(o) * bank.hidden + h]) * sum_slope[t];
        }
    }
    softmax3(out);
    for (uint32_t o = 0; o < 3; ++o)
        weights[o] = float(out[o]);
    for (uint32_t t = 0; t < tangents; ++t) {
        const double mean = out[0] * slope[t][0] + out[1] * slope[t][1] + out[2] * slope[t][2];
        for (uint32_t o = 0; o < 3; ++o)
            slopes[t][o] = float(out[o] * (slope[t][o] - mean));
    }
}

SensitivityTable prepare(const ModelView& model, uint32_t chunk, int32_t appearance, SensitivityScratch& scratch)
{
    const ModelParams& params = *model.params;
    const PackedMlpHeader& packed = *reinterpret_cast<const PackedMlpHeader*>(model.packed);
    const size_t F = params.feat_dim, columns = size_t(3) * packed.hidden_pad;
    const size_t rows = 2 * F + 3 + (1 + kProbeTangents) * (2 * columns + packed.out_pad[0]);
    const size_t lists = columns; // room for Rows::active, which needs only half, since its numbers have 16 bits
    scratch.values.reserve(rows * kMaxLanes + lists + columns + columns * kProbes * (1 + kProbeTangents));
    SensitivityTable table{};
    table.model = &model;
    table.bank_mlp = mlpRecord(model, MlpKind::FeatureBank);
    table.tangents = takesDistance(model) ? 2 : 1;
    table.rows = scratch.values.data(); // the first part of the scratch, so that rows are aligned
    float* values = table.rows + rows * kMaxLanes + lists;
    const auto take = [&values](size_t count) {
        float* p = values;
        values += count;
        return p;
    };
    float* zero = take(columns);
    std::fill_n(zero, columns, 0.0f);
    table.zero = zero;
    const float* weights = packedWeights(model, packed.first_f32);
    const float* bias = packedWeights(model, packed.first_bias_f32);
    const double level = anchorLevel(model, chunk), distance = sensitivityDistance(model, chunk);
    const auto weight = [&](size_t row, size_t column) { return double(weights[(F + row) * columns + column]); };
    for (uint32_t p = 0; p < kProbes; ++p) {
        const SensitivityProbe probe = sensitivityProbe(p, distance);
        float* base = take(columns);
        float* slope[kProbeTangents] = {take(columns), take(columns)};
        for (size_t c = 0; c < columns; ++c) {
            double sum = bias[c] + weight(3, c) * probe.distance + weight(4, c) * level;
            if (model.embedding != nullptr && appearance >= 0)
                for (size_t a = 0; a < params.appearance_dim; ++a)
                    sum += double(model.embedding[size_t(appearance) * params.appearance_dim + a]) *
                           weight(kViewRows + a, c);
            double along = 0;
            for (size_t i = 0; i < 3; ++i) {
                sum += weight(i, c) * probe.direction[i];
                along += weight(i, c) * probe.tangent[i];
            }
            base[c] = float(sum);
            slope[0][c] = float(along);
            slope[1][c] = float(weight(3, c) * probe.distance);
        }
        table.base[p] = base;
        std::copy_n(slope, kProbeTangents, table.slope[p]);
        if (table.bank_mlp != nullptr)
            bankAtProbe(model, *table.bank_mlp, probe, level, table.tangents, table.bank[p], table.bank_slope[p]);
    }
    return table;
}

} // namespace

SensitivityProbe sensitivityProbe(uint32_t probe, double distance)
{
    // axes of the fixed frame: rows of the rotation by the unit quaternion (2, 1, -1.4, 0.9) / |.|, chosen by hand
    constexpr double w = 2, x = 1, y = -1.4, z = 0.9, n = w * w + x * x + y * y + z * z;
    constexpr double axes[3][3] = {
        {1 - 2 * (y * y + z * z) / n, 2 * (x * y - z * w) / n, 2 * (x * z + y * w) / n},
        {2 * (x * y + z * w) / n, 1 - 2 * (x * x + z * z) / n, 2 * (y * z - x * w) / n},
        {2 * (x * z - y * w) / n, 2 * (y * z + x * w) / n, 1 - 2 * (x * x + y * y) / n},
    };
    constexpr double spread[3] = {1.0 / 3, 1, 3};
    SensitivityProbe result{};
    const uint32_t axis = probe / 2;
    for (uint32_t i = 0; i < 3; ++i) {
        result.direction[i] = probe % 2 == 0 ? axes[axis][i] : -axes[axis][i];
        result.tangent[i] = axes[(axis + 1 + probe % 2) % 3][i];
    }
    result.distance = distance * spread[probe % 3]; // each of the three distances for two probes, on different axes
    return result;
}

double sensitivityDistance(const ModelView& model, uint32_t chunk)
{
    const ModelParams& params = *model.params;
    double distance = 0;
    if (params.flags & kModelHasLevels) {
        distance = double(params.standard_dist) / std::pow(double(params.fork), double(anchorLevel(model, chunk)));
    } else {
        double square = 0;
        for (int i = 0; i < 3; ++i) {
            const double extent = double(params.bounds_max[i]) - double(params.bounds_min[i]);
            square += extent * extent;
        }
        distance = std::sqrt(square) / 4;
    }
    return distance > 0 && isFinite(distance) ? distance : 1;
}

bool takesDistance(const ModelView& model)
{
    const MlpRecord* records = reinterpret_cast<const MlpRecord*>(model.weights);
    for (uint32_t i = 0; i < model.params->mlp_count; ++i)
        if (records[i].inputs & kMlpTakesDistance)
            return true;
    return false;
}

void viewSensitivityCpu(const ModelView& model, uint32_t chunk, uint32_t first, uint32_t count, int32_t appearance,
                        float* direction, float* distance, SensitivityScratch& scratch)
{
    if (count == 0)
        return;
    const SensitivityTable table = prepare(model, chunk, appearance, scratch);
    HWY_DYNAMIC_DISPATCH(sensitivityBlock)(table, chunk, first, count, direction, distance);
}

} // namespace gsc
#endif
