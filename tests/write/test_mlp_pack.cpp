// SPDX-License-Identifier: Apache-2.0
#include "convert/write/mlp_pack.h"
#include <gsc/error.h>
#include <gsc/half.h>
#include "tests/write/memory_model.h"
#include "tests/support/outcome.h"

#include <doctest/doctest.h>

#include <cmath>
#include <cstring>

using namespace gsc;
using namespace gsc::test;

namespace {

ModelShape fullShape()
{
    ModelShape shape;
    shape.anchors = 1;
    shape.levels = 2;
    shape.feat_dim = 20; // padded to 32
    shape.n_offsets = 5; // outputs 5, 35, 15
    shape.appearance_dim = 7;
    shape.appearance_rows = 3;
    shape.feature_bank = shape.distance = shape.level_input = true;
    return shape;
}

template <typename T>
const T* at(const std::vector<std::byte>& bytes, uint64_t offset)
{
    return reinterpret_cast<const T*>(bytes.data() + offset);
}

// Upstream's arithmetic: first layer of one head on inputs given by name.
double firstLayer(const Mlp& mlp, const std::vector<double>& feature, const double view[5],
                  const std::vector<double>& appearance, uint32_t unit)
{
    std::vector<double> in = feature;
    in.insert(in.end(), view, view + 3);
    if (mlp.inputs & kMlpTakesDistance)
        in.push_back(view[3]);
    if (mlp.inputs & kMlpTakesLevel)
        in.push_back(view[4]);
    if (mlp.inputs & kMlpTakesAppearance)
        in.insert(in.end(), appearance.begin(), appearance.end());
    double sum = mlp.layers[0].bias[unit];
    for (size_t i = 0; i < in.size(); ++i)
        sum += in[i] * double(mlp.layers[0].weight[unit * in.size() + i]);
    return sum;
}

} // namespace

TEST_CASE("packed first layer computes what the three canonical ones compute")
{
    const ModelShape shape = fullShape();
    const MemoryModel model = makeModel(shape);
    const std::vector<Mlp>& mlps = model.checkpoint.mlps;
    const std::vector<std::byte> bytes = packMlps(mlps, shape.feat_dim, shape.appearance_dim);
    const auto& header = *at<PackedMlpHeader>(bytes, 0);
    CHECK(header.in_rows == 20 + 5 + 7);
    CHECK(header.hidden_pad == 32);
    CHECK(header.k_pad == 32);
    CHECK(header.out_pad[0] == 16);
    CHECK(header.out_pad[1] == 48);
    CHECK(header.out_pad[2] == 16);
    const uint32_t columns = 3 * header.hidden_pad;

    std::vector<double> feature(shape.feat_dim), appearance(shape.appearance_dim);
    for (size_t i = 0; i < feature.size(); ++i)
        feature[i] = std::sin(double(i));
    for (size_t i = 0; i < appearance.size(); ++i)
        appearance[i] = std::cos(double(i));
    const double view[5] = {0.1, -0.7, 0.6, 12.5, 3};
    std::vector<double> rows = feature;
    rows.insert(rows.end(), view, view + 5);
    rows.insert(rows.end(), appearance.begin(), appearance.end());

    const float* first = at<float>(bytes, header.first_f32);
    const float* bias = at<float>(bytes, header.first_bias_f32);
    for (uint32_t h = 0; h < 3; ++h)
        for (uint32_t u = 0; u < header.hidden_pad; ++u) {
            const uint32_t column = h * header.hidden_pad + u;
            double sum = bias[column];
            for (size_t r = 0; r < rows.size(); ++r)
                sum += rows[r] * double(first[r * columns + column]);
            const double expected = u < shape.feat_dim ? firstLayer(mlps[h], feature, view, appearance, u) : 0;
            REQUIRE(sum == doctest::Approx(expected).epsilon(1e-12));
        }
    for (uint32_t h = 0; h < 3; ++h) {
        const LinearLayer& second = mlps[h].layers[1];
        for (uint32_t i = 0; i < header.hidden_pad; ++i)
            for (uint32_t o = 0; o < header.out_pad[h]; ++o)
                REQUIRE(at<float>(bytes, header.second_f32[h])[i * header.out_pad[h] + o] ==
                        (i < second.in && o < second.out ? second.weight[o * second.in + i] : 0.0f));
        for (uint32_t o = 0; o < header.out_pad[h]; ++o)
            REQUIRE(at<float>(bytes, header.second_bias_f32[h])[o] == (o < second.out ? second.bias[o] : 0.0f));
    }
}

TEST_CASE("fragments are where mma.sync.m16n8k16 looks for them, and finite")
{
    const ModelShape shape = fullShape();
    MemoryModel model = makeModel(shape);
    model.checkpoint.mlps[0].layers[0].weight[0] = 1e6f;
    model.checkpoint.mlps[1].layers[1].weight[0] = -1e6f;
    const auto half = [](float value) { return value == 1e6f ? 0x7bff : value == -1e6f ? 0xfbff : floatToHalf(value); };
    const std::vector<std::byte> bytes = packMlps(model.checkpoint.mlps, shape.feat_dim, shape.appearance_dim);
    const auto& header = *at<PackedMlpHeader>(bytes, 0);
    const uint32_t columns = 3 * header.hidden_pad;
    // element (k, n) of B, by the PTX manual: lane 4 (n mod 8) + (k mod 8) / 2, register (k mod 16) / 8, half k mod 2
    const auto element = [](const uint16_t* fragments, uint32_t total_columns, uint32_t k, uint32_t n) {
        const uint32_t tile = k / 16 * (total_columns / 8) + n / 8, lane = 4 * (n % 8) + k % 8 / 2;
        return fragments[(size_t(tile) * 32 + lane) * 4 + 2 * (k % 16 / 8) + k % 2];
    };
    for (uint32_t k = 0; k < header.k_pad; ++k)
        for (uint32_t n = 0; n < columns; ++n) {
            const bool used = k < shape.feat_dim + 5; // appearance is folded into the bias at load time
            const float value = used ? at<float>(bytes, header.first_f32)[k * columns + n] : 0.0f;
            REQUIRE(element(at<uint16_t>(bytes, header.first_f16), columns, k, n) == half(value));
        }
    for (uint32_t h = 0; h < 3; ++h)
        for (uint32_t k = 0; k < header.hidden_pad; ++k)
            for (uint32_t n = 0; n < header.out_pad[h]; ++n)
                REQUIRE(element(at<uint16_t>(bytes, header.second_f16[h]), header.out_pad[h], k, n) ==
                        half(at<float>(bytes, header.second_f32[h])[k * header.out_pad[h] + n]));
}

TEST_CASE("weights that are not finite are refused")
{
    MemoryModel model = makeModel(fullShape());
    checkMlps(model.checkpoint.mlps, "x");
    model.checkpoint.mlps[2].layers[1].bias[4] = NAN;
    const Outcome refused = outcomeOf([&] { checkMlps(model.checkpoint.mlps, "x"); });
    CHECK(refused.code == ErrorCode::InvalidFile);
    CHECK(refused.says("layer 1 of the colour mlp holds nan at element 4 of its bias"));
}
