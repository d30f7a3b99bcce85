// SPDX-License-Identifier: Apache-2.0
// The hand-made MLPs give back what features say.
#include "convert/sample/model/sample_weights.h"

#include <doctest/doctest.h>

#include <cmath>
#include <vector>

using namespace gsc;

namespace {

std::vector<float> evaluate(const Mlp& mlp, const std::vector<float>& input)
{
    REQUIRE(mlp.layers[0].in == input.size());
    std::vector<float> values = input;
    for (const LinearLayer& layer : mlp.layers) {
        std::vector<float> next(layer.out);
        for (uint32_t i = 0; i < layer.out; ++i) {
            next[i] = layer.bias[i];
            for (uint32_t j = 0; j < layer.in; ++j)
                next[i] += layer.weight[i * layer.in + j] * values[j];
            if (&layer == &mlp.layers[0])
                next[i] = std::max(0.0f, next[i]);
        }
        values = next;
    }
    return values;
}

// A feature vector and a view direction.
std::vector<float> input(const std::vector<std::pair<uint32_t, float>>& features, float x, float y, float z)
{
    std::vector<float> values(kSampleFeatures + 3, 0.0f);
    for (const auto& [index, value] : features)
        values[index] = value;
    values[kSampleFeatures] = x;
    values[kSampleFeatures + 1] = y;
    values[kSampleFeatures + 2] = z;
    return values;
}

const float kGlint[3] = {-0.62f, -0.42f, -0.66f};

} // namespace

TEST_CASE("sample weights: the alive share decides how many Gaussians have an opacity")
{
    const std::vector<Mlp> mlps = sampleMlps({}, kGlint);
    for (const float share : {0.5f, 1.0f}) {
        const std::vector<float> logits = evaluate(mlps[0], input({{kFeatureAlive, share}}, 0, 0.6f, -0.8f));
        for (uint32_t k = 0; k < kSampleOffsets; ++k) {
            CAPTURE(k);
            const bool alive = float(k) < share * kSampleOffsets;
            CHECK((std::tanh(logits[k]) > 0.9f) == alive);
            CHECK((std::tanh(logits[k]) < -0.5f) == !alive);
        }
    }
}

TEST_CASE("sample weights: colours come out as they were encoded")
{
    const std::vector<Mlp> mlps = sampleMlps({}, kGlint);
    const std::vector<float> logits = evaluate(mlps[2], input({{kFeatureBase, -1.25f},
                                                               {kFeatureBase + 1, 0.5f},
                                                               {kFeatureBase + 2, 2.0f},
                                                               {kFeatureLight + 4, 0.75f},
                                                               {kFeatureHue + 7, -1.5f}},
                                                              0.6f, 0, -0.8f));
    const float base[3] = {-1.25f, 0.5f, 2.0f};
    for (uint32_t k = 0; k < kSampleOffsets; ++k)
        for (uint32_t c = 0; c < 3; ++c) {
            CAPTURE(k);
            CAPTURE(c);
            const float expected = base[c] + (k == 4 ? 0.75f : 0) + (k == 7 ? -1.5f * kHueAxis[c] : 0);
            CHECK(logits[3 * k + c] == doctest::Approx(expected).epsilon(1e-5));
        }
}

TEST_CASE("sample weights: glass brightens towards grazing views, plaster does not")
{
    const std::vector<Mlp> mlps = sampleMlps({}, kGlint);
    const auto brightness = [&](float gloss, float x, float y) {
        return evaluate(mlps[2], input({{kFeatureGloss, gloss}}, x, y, 0))[1];
    };
    // a facade that faces +x, seen head on and along it
    CHECK(brightness(1, -0.2f, 0.98f) > brightness(1, -0.98f, 0.2f) + 0.5f);
    CHECK(brightness(0, -0.2f, 0.98f) == doctest::Approx(brightness(0, -0.98f, 0.2f)));
}

TEST_CASE("sample weights: the rotation is the one encoded")
{
    const std::vector<Mlp> mlps = sampleMlps({}, kGlint);
    const std::vector<float> out =
        evaluate(mlps[1], input({{kFeatureTurn, 1.0f}, {kFeatureTurn + 1, -0.5f}, {kFeatureTurn + 2, 0.25f}}, 1, 0, 0));
    for (uint32_t k = 0; k < kSampleOffsets; ++k) {
        const float* q = &out[7 * k + 3];
        CHECK(q[0] == doctest::Approx(1));
        CHECK(q[1] == doctest::Approx(1));
        CHECK(q[2] == doctest::Approx(-0.5));
        CHECK(q[3] == doctest::Approx(0.25));
        CHECK(1 / (1 + std::exp(-out[7 * k])) == doctest::Approx(kSizeShare));
    }
}
