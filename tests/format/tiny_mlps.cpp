// SPDX-License-Identifier: Apache-2.0
#include "tests/format/tiny_mlps.h"

#include <cmath>
#include <cstring>

namespace gsc::test {

namespace {

struct Matrix {
    uint32_t rows = 0, columns = 0;
    std::vector<float> values; // row-major

    Matrix(uint32_t r, uint32_t c) : rows(r), columns(c), values(size_t(r) * c) {}
    float& at(uint32_t r, uint32_t c) { return values[size_t(r) * columns + c]; }
};

Matrix randomMatrix(uint32_t rows, uint32_t columns, std::mt19937_64& random)
{
    Matrix m(rows, columns);
    for (float& value : m.values)
        value = float(int(random() % 129) - 64) / 64.0f;
    return m;
}

uint16_t exactHalf(float value)
{
    if (value == 0)
        return std::signbit(value) ? 0x8000 : 0;
    int exponent;
    const float mantissa = std::frexp(std::fabs(value), &exponent); // [0.5, 1)
    return uint16_t((value < 0 ? 0x8000 : 0) | (exponent + 14) << 10 | (int(mantissa * 2048) & 0x3ff));
}

uint64_t append(std::vector<std::byte>& out, const void* data, size_t bytes, uint64_t alignment)
{
    const uint64_t offset = alignUp(out.size(), alignment);
    out.resize(offset + bytes);
    std::memcpy(out.data() + offset, data, bytes);
    return offset;
}

uint64_t appendFloats(std::vector<std::byte>& out, const Matrix& m, uint64_t alignment)
{
    return append(out, m.values.data(), m.values.size() * sizeof(float), alignment);
}

uint64_t appendFragments(std::vector<std::byte>& out, Matrix& m)
{
    std::vector<uint16_t> halves;
    for (uint32_t k = 0; k < m.rows; k += 16)
        for (uint32_t n = 0; n < m.columns; n += 8)
            for (uint32_t lane = 0; lane < 32; ++lane)
                for (const uint32_t row : {0u, 1u, 8u, 9u})
                    halves.push_back(exactHalf(m.at(k + 2 * (lane % 4) + row, n + lane / 4)));
    return append(out, halves.data(), halves.size() * sizeof(uint16_t), 256);
}

struct Layer {
    MlpRecord record;
    Matrix weight0, bias0, weight1, bias1;
};

Layer makeLayer(const TinyGscOptions& o, MlpKind kind, std::mt19937_64& random)
{
    constexpr Activation kActivations[] = {Activation::Tanh, Activation::None, Activation::Sigmoid,
                                           Activation::Softmax};
    const uint32_t out[] = {o.n_offsets, 7 * o.n_offsets, 3 * o.n_offsets, 3};
    MlpRecord r{};
    r.kind = uint32_t(kind);
    r.activation = uint32_t(kActivations[r.kind]);
    r.hidden = o.feat_dim;
    r.out = out[r.kind];
    if (kind == MlpKind::FeatureBank) {
        r.inputs = o.levels == 1 ? kMlpTakesDistance : kMlpTakesLevel;
        r.in = 4;
    } else {
        const bool appearance = kind == MlpKind::Color && o.appearance_dim > 0;
        r.inputs = kMlpTakesFeature | (o.distance_inputs ? kMlpTakesDistance : 0u) |
                   (o.level_inputs ? kMlpTakesLevel : 0u) | (appearance ? kMlpTakesAppearance : 0u);
        r.in = o.feat_dim + 3 + o.distance_inputs + o.level_inputs + (appearance ? o.appearance_dim : 0);
    }
    Matrix weight0 = randomMatrix(r.hidden, r.in, random), bias0 = randomMatrix(1, r.hidden, random);
    Matrix weight1 = randomMatrix(r.out, r.hidden, random), bias1 = randomMatrix(1, r.out, random);
    return {r, std::move(weight0), std::move(bias0), std::move(weight1), std::move(bias1)};
}

std::vector<std::byte> pack(const TinyGscOptions& o, std::vector<Layer>& layers)
{
    PackedMlpHeader h{};
    h.in_rows = o.feat_dim + 5 + o.appearance_dim;
    h.hidden_pad = uint32_t(alignUp(o.feat_dim, 16));
    h.k_pad = uint32_t(alignUp(o.feat_dim + 5, 16));
    std::vector<std::byte> out(sizeof(h));
    Matrix first(h.in_rows, 3 * h.hidden_pad), bias(1, 3 * h.hidden_pad), first_k(h.k_pad, 3 * h.hidden_pad);
    for (uint32_t head = 0; head < 3; ++head) {
        Layer& l = layers[head];
        std::vector<uint32_t> rows;
        for (uint32_t i = 0; i < o.feat_dim + 3; ++i)
            rows.push_back(i);
        if (o.distance_inputs)
            rows.push_back(o.feat_dim + 3);
        if (o.level_inputs)
            rows.push_back(o.feat_dim + 4);
        while (rows.size() < l.record.in) // appearance
            rows.push_back(o.feat_dim + 5 + uint32_t(rows.size()) -
                           (o.feat_dim + 3 + o.distance_inputs + o.level_inputs));
        for (uint32_t c = 0; c < l.record.hidden; ++c) {
            bias.at(0, head * h.hidden_pad + c) = l.bias0.at(0, c);
            for (uint32_t i = 0; i < l.record.in; ++i) {
                first.at(rows[i], head * h.hidden_pad + c) = l.weight0.at(c, i);
                if (rows[i] < o.feat_dim + 5)
                    first_k.at(rows[i], head * h.hidden_pad + c) = l.weight0.at(c, i);
            }
        }
        h.out_pad[head] = uint32_t(alignUp(l.record.out, 16));
        Matrix second(h.hidden_pad, h.out_pad[head]), second_bias(1, h.out_pad[head]);
        for (uint32_t r = 0; r < l.record.out; ++r) {
            second_bias.at(0, r) = l.bias1.at(0, r);
            for (uint32_t c = 0; c < l.record.hidden; ++c)
                second.at(c, r) = l.weight1.at(r, c);
        }
        h.second_f32[head] = appendFloats(out, second, 256);
        h.second_bias_f32[head] = appendFloats(out, second_bias, 256);
        h.second_f16[head] = appendFragments(out, second);
    }
    h.first_f32 = appendFloats(out, first, 256);
    h.first_bias_f32 = appendFloats(out, bias, 256);
    h.first_f16 = appendFragments(out, first_k);
    std::memcpy(out.data(), &h, sizeof(h));
    return out;
}

} // namespace

TinyMlps tinyMlps(const TinyGscOptions& options, std::mt19937_64& random)
{
    std::vector<Layer> layers;
    for (uint32_t kind = 0; kind < (options.feature_bank ? 4u : 3u); ++kind)
        layers.push_back(makeLayer(options, MlpKind(kind), random));
    TinyMlps mlps;
    mlps.canonical.resize(layers.size() * sizeof(MlpRecord));
    for (size_t i = 0; i < layers.size(); ++i) {
        Layer& l = layers[i];
        l.record.weight0 = appendFloats(mlps.canonical, l.weight0, 64);
        l.record.bias0 = appendFloats(mlps.canonical, l.bias0, 64);
        l.record.weight1 = appendFloats(mlps.canonical, l.weight1, 64);
        l.record.bias1 = appendFloats(mlps.canonical, l.bias1, 64);
        std::memcpy(mlps.canonical.data() + i * sizeof(MlpRecord), &l.record, sizeof(MlpRecord));
    }
    mlps.packed = pack(options, layers);
    return mlps;
}

} // namespace gsc::test
