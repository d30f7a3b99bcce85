// SPDX-License-Identifier: Apache-2.0
#include "convert/write/mlp_pack.h"

#include <gsc/error.h>
#include <gsc/half.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstring>
#include <numeric>

namespace gsc {

namespace {

constexpr uint32_t kHeads = 3;
constexpr uint64_t kWeightAlign = 64;
constexpr uint64_t kPackedAlign = 256;
constexpr uint32_t kTileK = 16, kTileN = 8; // size of a matrix tile of the GPU instruction mma.sync.m16n8k16
constexpr uint32_t kViewInputs = 5;         // direction (3), distance, level

// For each input of one of the three heads: the row of the fused first layer, which has a row for every possible input.
std::vector<uint32_t> fusedRows(uint32_t inputs, uint32_t feat_dim, uint32_t appearance_dim)
{
    std::vector<uint32_t> rows(feat_dim + 3);
    std::iota(rows.begin(), rows.end(), 0u);
    if (inputs & kMlpTakesDistance)
        rows.push_back(feat_dim + 3);
    if (inputs & kMlpTakesLevel)
        rows.push_back(feat_dim + 4);
    if (inputs & kMlpTakesAppearance)
        for (uint32_t i = 0; i < appearance_dim; ++i)
            rows.push_back(feat_dim + kViewInputs + i);
    return rows;
}

// Appends `count` zeros of type T at the next multiple of `alignment` bytes; returns their byte offset.
template <typename T>
uint64_t appendArray(std::vector<std::byte>& bytes, uint64_t count, uint64_t alignment)
{
    const uint64_t offset = alignUp(bytes.size(), alignment);
    bytes.resize(offset + count * sizeof(T));
    return offset;
}

template <typename T>
T* at(std::vector<std::byte>& bytes, uint64_t offset)
{
    return reinterpret_cast<T*>(bytes.data() + offset);
}

// Converts a row-major matrix to halves in the order in which the GPU instruction loads them. `stride`: floats from row
// to row. rows and columns must be multiples of a tile, all values finite.
void packFragments(const float* matrix, uint32_t stride, uint32_t rows, uint32_t columns, uint16_t* out)
{
    for (uint32_t kt = 0; kt < rows / kTileK; ++kt)
        for (uint32_t nt = 0; nt < columns / kTileN; ++nt)
            for (uint32_t lane = 0; lane < 32; ++lane)
                for (uint32_t half = 0; half < 4; ++half) {
                    const uint32_t row = kt * kTileK + 2 * (lane % 4) + half % 2 + (half / 2) * 8;
                    const uint32_t column = nt * kTileN + lane / 4;
                    // clamped to the largest half, because one infinite weight would turn whole pictures into NaN
                    *out++ = floatToHalf(std::clamp(matrix[size_t(row) * stride + column], -65504.0f, 65504.0f));
                }
}

} // namespace

void checkMlps(std::span<const Mlp> mlps, const char* name)
{
    static const char* const kNames[] = {"opacity", "covariance", "colour", "feature bank"};
    for (const Mlp& mlp : mlps)
        for (const LinearLayer& layer : mlp.layers)
            for (const std::vector<float>* values : {&layer.weight, &layer.bias}) {
                const auto bad = std::ranges::find_if_not(*values, [](float value) { return std::isfinite(value); });
                if (bad != values->end())
                    throw Error(ErrorCode::InvalidFile, name,
                                formatString("layer %d of the %s mlp holds %g at element %zu of its %s",
                                             int(&layer - mlp.layers), kNames[uint32_t(mlp.kind)], double(*bad),
                                             size_t(bad - values->begin()), values == &layer.bias ? "bias" : "weight"),
                                "finite numbers", "the training diverged");
            }
}

std::vector<std::byte> canonicalMlps(std::span<const Mlp> mlps)
{
    std::vector<std::byte> bytes(mlps.size() * sizeof(MlpRecord));
    for (size_t i = 0; i < mlps.size(); ++i) {
        const Mlp& mlp = mlps[i];
        MlpRecord record{};
        record.kind = uint32_t(mlp.kind);
        record.activation = uint32_t(mlp.activation);
        record.inputs = mlp.inputs;
        record.in = mlp.layers[0].in;
        record.hidden = mlp.layers[0].out;
        record.out = mlp.layers[1].out;
        const auto append = [&](const std::vector<float>& values) {
            const uint64_t offset = appendArray<float>(bytes, values.size(), kWeightAlign);
            if (!values.empty())
                std::memcpy(bytes.data() + offset, values.data(), values.size() * sizeof(float));
            return offset;
        };
        record.weight0 = append(mlp.layers[0].weight);
        record.bias0 = append(mlp.layers[0].bias);
        record.weight1 = append(mlp.layers[1].weight);
        record.bias1 = append(mlp.layers[1].bias);
        std::memcpy(bytes.data() + i * sizeof(MlpRecord), &record, sizeof(record));
    }
    return bytes;
}

std::vector<std::byte> packMlps(std::span<const Mlp> mlps, uint32_t feat_dim, uint32_t appearance_dim)
{
    PackedMlpHeader header{};
    header.in_rows = feat_dim + kViewInputs + appearance_dim;
    header.hidden_pad = uint32_t(alignUp(feat_dim, 16));
    header.k_pad = uint32_t(alignUp(feat_dim + kViewInputs, kTileK));
    const uint32_t columns = kHeads * header.hidden_pad;

    std::vector<std::byte> bytes(sizeof(PackedMlpHeader));
    header.first_f32 = appendArray<float>(bytes, uint64_t(header.in_rows) * columns, kPackedAlign);
    header.first_bias_f32 = appendArray<float>(bytes, columns, kPackedAlign);
    for (uint32_t h = 0; h < kHeads; ++h) {
        header.out_pad[h] = uint32_t(alignUp(mlps[h].layers[1].out, 16));
        header.second_f32[h] = appendArray<float>(bytes, uint64_t(header.hidden_pad) * header.out_pad[h], kPackedAlign);
        header.second_bias_f32[h] = appendArray<float>(bytes, header.out_pad[h], kPackedAlign);
    }
    header.first_f16 = appendArray<uint16_t>(bytes, uint64_t(header.k_pad) * columns, kPackedAlign);
    for (uint32_t h = 0; h < kHeads; ++h)
        header.second_f16[h] =
            appendArray<uint16_t>(bytes, uint64_t(header.hidden_pad) * header.out_pad[h], kPackedAlign);
    std::memcpy(bytes.data(), &header, sizeof(header));

    // first layer for half precision: without the rows of the appearance, and with rows of zeros up to k_pad
    std::vector<float> first_k(size_t(header.k_pad) * columns);
    for (uint32_t h = 0; h < kHeads; ++h) {
        const LinearLayer& first = mlps[h].layers[0];
        const std::vector<uint32_t> rows = fusedRows(mlps[h].inputs, feat_dim, appearance_dim);
        assert(rows.size() == first.in);
        for (uint32_t o = 0; o < first.out; ++o) {
            const uint32_t column = h * header.hidden_pad + o;
            for (uint32_t i = 0; i < first.in; ++i) {
                const float weight = first.weight[size_t(o) * first.in + i];
                at<float>(bytes, header.first_f32)[size_t(rows[i]) * columns + column] = weight;
                if (rows[i] < feat_dim + kViewInputs)
                    first_k[size_t(rows[i]) * columns + column] = weight;
            }
            at<float>(bytes, header.first_bias_f32)[column] = first.bias[o];
        }
        const LinearLayer& second = mlps[h].layers[1];
        float* transposed = at<float>(bytes, header.second_f32[h]);
        for (uint32_t o = 0; o < second.out; ++o) {
            for (uint32_t i = 0; i < second.in; ++i)
                transposed[size_t(i) * header.out_pad[h] + o] = second.weight[size_t(o) * second.in + i];
            at<float>(bytes, header.second_bias_f32[h])[o] = second.bias[o];
        }
        packFragments(transposed, header.out_pad[h], header.hidden_pad, header.out_pad[h],
                      at<uint16_t>(bytes, header.second_f16[h]));
    }
    packFragments(first_k.data(), columns, header.k_pad, columns, at<uint16_t>(bytes, header.first_f16));
    return bytes;
}

} // namespace gsc
