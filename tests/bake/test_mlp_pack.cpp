// SPDX-License-Identifier: Apache-2.0
#include "convert/bake/mlp_pack.h"
#include "format/error.h"
#include "tests/bake/memory_model.h"

#include <doctest/doctest.h>

#include <cmath>
#include <cstring>

using namespace gsc;
using namespace gsc::test;

namespace {

float halfToFloat(uint16_t half)
{
    const int exponent = half >> 10 & 31, mantissa = half & 1023;
    const double value = exponent == 0    ? std::ldexp(mantissa, -24)
                         : exponent == 31 ? (mantissa ? NAN : INFINITY)
                                          : std::ldexp(1024 + mantissa, exponent - 25);
    return float(half & 0x8000 ? -value : value);
}

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

TEST_CASE("halves round to nearest even over the whole range")
{
    for (uint32_t h = 0; h < 0x7c00; ++h) {
        const float exact = halfToFloat(uint16_t(h)), next = halfToFloat(uint16_t(h + 1));
        REQUIRE(floatToHalf(exact) == h);
        REQUIRE(floatToHalf(-exact) == (h | 0x8000u));
        if (h + 1 == 0x7c00)
            break;
        const float middle = 0.5f * (exact + next);
        REQUIRE(floatToHalf(middle) == (h % 2 == 0 ? h : h + 1));
        REQUIRE(floatToHalf(std::nextafter(middle, 0.0f)) == h);
        REQUIRE(floatToHalf(std::nextafter(middle, 1e9f)) == h + 1);
    }
    CHECK(floatToHalf(1e6f) == 0x7bff); // the largest finite half
    CHECK(floatToHalf(-65520.0f) == 0xfbff);
    CHECK(floatToHalf(1e-10f) == 0);
    CHECK(floatToHalf(INFINITY) == 0x7c00);
    CHECK(std::isnan(halfToFloat(floatToHalf(NAN))));
}

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

TEST_CASE("fragments are where mma.sync.m16n8k16 looks for them")
{
    const ModelShape shape = fullShape();
    const MemoryModel model = makeModel(shape);
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
            REQUIRE(element(at<uint16_t>(bytes, header.first_f16), columns, k, n) == floatToHalf(value));
        }
    for (uint32_t h = 0; h < 3; ++h)
        for (uint32_t k = 0; k < header.hidden_pad; ++k)
            for (uint32_t n = 0; n < header.out_pad[h]; ++n)
                REQUIRE(element(at<uint16_t>(bytes, header.second_f16[h]), header.out_pad[h], k, n) ==
                        floatToHalf(at<float>(bytes, header.second_f32[h])[k * header.out_pad[h] + n]));
}

TEST_CASE("trap 2: weights that do not fit the inputs, or are not finite, are refused")
{
    const ModelShape shape = fullShape();
    const auto check = [&](MemoryModel model, const char* expected) {
        try {
            checkMlps(model.checkpoint.mlps, shape.feat_dim, shape.n_offsets, shape.appearance_dim, "x");
            FAIL("no error, expected: " << expected);
        } catch (const Error& error) {
            CHECK(error.code() == ErrorCode::InvalidFile);
            CHECK(std::string(error.what()).find(expected) != std::string::npos);
        }
    };
    MemoryModel wide = makeModel(shape), infinite = makeModel(shape), missing = makeModel(shape);
    wide.checkpoint.mlps[1].inputs &= ~uint32_t(kMlpTakesLevel);
    check(wide, "layer 0 of the covariance mlp is 25 -> 20, expected 24 -> 20");
    infinite.checkpoint.mlps[2].layers[1].bias[4] = NAN;
    check(infinite, "layer 1 of the colour mlp holds nan at element 4 of its bias");
    missing.checkpoint.mlps.resize(2);
    check(missing, "has 2 mlps");
    checkMlps(makeModel(shape).checkpoint.mlps, shape.feat_dim, shape.n_offsets, shape.appearance_dim, "x");
}
