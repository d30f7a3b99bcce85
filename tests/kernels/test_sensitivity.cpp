// SPDX-License-Identifier: Apache-2.0
// View sensitivity: fast version against differences in double, over shapes, inputs and block edges; what it predicts
// against what really changes.
#include "kernels/sensitivity/sensitivity.h"
#include "tests/kernels/simd_targets.h"
#include "tests/kernels/synthetic_model.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

using namespace gsc;
using namespace gsc::test;

namespace {

struct Sensitivities {
    std::vector<float> direction, distance;
};

Sensitivities fastOf(const ModelView& model, uint32_t chunk, uint32_t first, uint32_t count, int32_t appearance)
{
    SensitivityScratch scratch;
    Sensitivities s{std::vector<float>(count + 1, -1.0f), std::vector<float>(count + 1, -1.0f)};
    viewSensitivityCpu(model, chunk, first, count, appearance, s.direction.data(), s.distance.data(), scratch);
    CHECK(s.direction[count] == -1); // nothing is written past the last anchor
    CHECK(s.distance[count] == -1);
    s.direction.pop_back();
    s.distance.pop_back();
    return s;
}

// A ReLU or an opacity floor within rounding of a probe may fall to the other side: a few anchors may differ.
void checkModel(const SyntheticOptions& options)
{
    CAPTURE(options.feat_dim);
    CAPTURE(options.n_offsets);
    CAPTURE(options.inputs);
    CAPTURE(options.flags);
    const SyntheticModel model(options);
    const ModelView& view = model.view();
    const int32_t appearance = options.appearance_dim > 0 ? int32_t(options.appearance_rows) - 1 : -1;
    std::vector<Sensitivities> wanted(view.params->chunk_count);
    for (uint32_t c = 0; c < view.params->chunk_count; ++c)
        for (uint32_t i = 0; i < view.chunks[c].anchor_count; ++i) {
            double direction, distance;
            viewSensitivityReference(view, c, i, appearance, direction, distance);
            wanted[c].direction.push_back(float(direction));
            wanted[c].distance.push_back(float(distance));
        }
    forEachTarget([&](const char* target) {
        CAPTURE(target);
        size_t anchors = 0, apart = 0, nonzero = 0;
        for (uint32_t c = 0; c < view.params->chunk_count; ++c) {
            const Sensitivities fast = fastOf(view, c, 0, view.chunks[c].anchor_count, appearance);
            for (size_t i = 0; i < fast.direction.size(); ++i) {
                const auto differs = [](float a, float b) { return !(std::abs(a - b) <= 1e-4f * (b + 0.01f)); };
                ++anchors;
                apart += differs(fast.direction[i], wanted[c].direction[i]) ||
                         differs(fast.distance[i], wanted[c].distance[i]);
                nonzero += fast.direction[i] > 0;
                if (takesDistance(view))
                    nonzero += fast.distance[i] > 0;
                else
                    CHECK(fast.distance[i] == 0);
            }
        }
        CHECK(nonzero > anchors / 2);
        CHECK(apart * 100 <= anchors + 50);
    });
}

} // namespace

TEST_CASE("probes are unit, opposite in pairs that turn two ways, and no axis of the scene")
{
    for (uint32_t p = 0; p < kProbes; ++p) {
        const SensitivityProbe probe = sensitivityProbe(p, 2);
        const SensitivityProbe opposite = sensitivityProbe(p ^ 1, 2);
        const double* vectors[3] = {probe.direction, probe.tangent, opposite.tangent};
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j) {
                double dot = 0;
                for (int a = 0; a < 3; ++a)
                    dot += vectors[i][a] * vectors[j][a];
                CHECK(dot == doctest::Approx(i == j ? 1 : 0));
            }
        for (const double v : probe.direction)
            CHECK(std::abs(v) > 0.05);
        for (int a = 0; a < 3; ++a)
            CHECK(opposite.direction[a] == -probe.direction[a]);
    }
    CHECK(sensitivityProbe(0, 3).distance == doctest::Approx(1));
    CHECK(sensitivityProbe(1, 3).distance == 3);
    CHECK(sensitivityProbe(2, 3).distance == 9);
}

TEST_CASE("fast sensitivities are the reference's for many shapes")
{
    for (const auto& [F, K] :
         {std::pair<uint32_t, uint32_t>{32, 10}, {4, 1}, {50, 3}, {33, 17}, {16, 25}, {64, 5}, {7, 12}}) {
        SyntheticOptions options{.anchors = 150, .feat_dim = F, .n_offsets = K};
        checkModel(options);
    }
}

TEST_CASE("distance, level and appearance inputs, and the feature bank of both trainers")
{
    for (const uint32_t inputs : {uint32_t(kMlpTakesDistance), uint32_t(kMlpTakesLevel), uint32_t(kMlpTakesAppearance),
                                  uint32_t(kMlpTakesDistance | kMlpTakesLevel | kMlpTakesAppearance)})
        for (const uint32_t bank : {0u, kModelFeatureBank | kModelBankDistance, kModelFeatureBank | kModelBankLevel,
                                    uint32_t(kModelFeatureBank)}) {
            SyntheticOptions options{.anchors = 90,
                                     .appearance_dim = inputs & kMlpTakesAppearance ? 32u : 0u,
                                     .appearance_rows = inputs & kMlpTakesAppearance ? 3u : 0u,
                                     .levels = 3,
                                     .flags = kModelHasLevels | bank,
                                     .inputs = inputs,
                                     .level_rule = LevelRule::Floor};
            checkModel(options);
        }
}

TEST_CASE("an anchor's sensitivity does not depend on the range it is asked for in")
{
    const SyntheticModel model({.anchors = 1000});
    const ModelView& view = model.view();
    uint32_t chunk = 0;
    for (uint32_t c = 0; c < view.params->chunk_count; ++c)
        if (view.chunks[c].anchor_count > view.chunks[chunk].anchor_count)
            chunk = c;
    const uint32_t count = view.chunks[chunk].anchor_count;
    REQUIRE(count > 40);
    const Sensitivities all = fastOf(view, chunk, 0, count, -1);
    for (const auto& [first, n] : {std::pair<uint32_t, uint32_t>{0, 1}, {3, 7}, {1, 16}, {5, 33}, {count - 1, 1}}) {
        const Sensitivities some = fastOf(view, chunk, first, n, -1);
        CHECK(std::memcmp(some.direction.data(), all.direction.data() + first, n * sizeof(float)) == 0);
    }
    fastOf(view, chunk, 7, 0, -1);
}

TEST_CASE("machines with fused multiply-add agree to the last bit")
{
    const SyntheticModel model({.anchors = 200, .flags = kModelFeatureBank, .inputs = kMlpTakesDistance});
    std::vector<Sensitivities> results;
    forEachTarget([&](const char* target) {
        if (std::strstr(target, "AVX") != nullptr || std::strstr(target, "NEON") != nullptr)
            results.push_back(fastOf(model.view(), 0, 0, model.view().chunks[0].anchor_count, -1));
    });
    for (const Sensitivities& result : results) {
        CHECK(result.direction == results.front().direction);
        CHECK(result.distance == results.front().distance);
    }
}

TEST_CASE("anchors whose values are not numbers are infinitely sensitive, their neighbours are not")
{
    SyntheticOptions options{.anchors = 60};
    SyntheticAnchors anchors = randomAnchors(options);
    const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
    anchors.feature[32 * 7 + 3] = nan;
    anchors.feature[32 * 21 + 31] = inf;
    anchors.scale[6 * 30 + 3] = -inf; // trap 15: an extent of zero is a number
    anchors.scale[6 * 30 + 4] = -inf;
    anchors.scale[6 * 30 + 5] = -inf;
    const SyntheticModel model(syntheticParams(options), anchors, randomMlps(options), {}, 0);
    const ModelView& view = model.view();
    forEachTarget([&](const char* target) {
        CAPTURE(target);
        for (uint32_t c = 0; c < view.params->chunk_count; ++c) {
            const Sensitivities s = fastOf(view, c, 0, view.chunks[c].anchor_count, -1);
            for (uint32_t i = 0; i < s.direction.size(); ++i) {
                const uint32_t source = view.arrays[c].source_index[i];
                CAPTURE(source);
                CHECK(std::isinf(s.direction[i]) == (source == 7 || source == 21));
                CHECK(s.direction[i] >= 0);
            }
        }
    });
}

TEST_CASE("what draws nothing, or the same from everywhere, has no sensitivity")
{
    SyntheticOptions options{.anchors = 50};
    std::vector<Mlp> mlps = randomMlps(options);
    std::fill(mlps[0].layers[1].weight.begin(), mlps[0].layers[1].weight.end(), 0.0f);
    std::fill(mlps[0].layers[1].bias.begin(), mlps[0].layers[1].bias.end(), 0.001f); // below 1/255
    const SyntheticModel unseen(syntheticParams(options), randomAnchors(options), mlps, {}, 0);
    for (const float s : fastOf(unseen.view(), 0, 0, unseen.view().chunks[0].anchor_count, -1).direction)
        CHECK(s == 0);

    for (const auto& [opacity, sensitive] : {std::pair<float, bool>{0.99f / 255, false}, {1.02f / 255, true}}) {
        CAPTURE(opacity);
        std::fill(mlps[0].layers[1].bias.begin(), mlps[0].layers[1].bias.end(), opacity);
        const SyntheticModel faint(syntheticParams(options), randomAnchors(options), mlps, {}, 0);
        const ModelView& view = faint.view();
        forEachTarget([&](const char* target) {
            CAPTURE(target);
            const Sensitivities fast = fastOf(view, 0, 0, view.chunks[0].anchor_count, -1);
            for (uint32_t i = 0; i < fast.direction.size(); ++i) {
                double direction, distance;
                viewSensitivityReference(view, 0, i, -1, direction, distance);
                CHECK((fast.direction[i] > 0) == sensitive);
                CHECK((direction > 0) == sensitive);
            }
        });
    }

    mlps = randomMlps(options);
    const uint32_t F = options.feat_dim;
    for (Mlp& mlp : mlps)
        for (uint32_t h = 0; h < mlp.layers[0].out; ++h)
            for (uint32_t i = 0; i < 3; ++i)
                mlp.layers[0].weight[size_t(h) * mlp.layers[0].in + F + i] = 0;
    const SyntheticModel constant(syntheticParams(options), randomAnchors(options), mlps, {}, 0);
    for (const float s : fastOf(constant.view(), 0, 0, constant.view().chunks[0].anchor_count, -1).direction)
        CHECK(s == 0);
}

TEST_CASE("distances that probes stand for")
{
    SyntheticOptions options;
    SyntheticModel plain(options);
    const float low[3] = {-1, 2, 0}, high[3] = {1, 4, 1};
    std::copy_n(low, 3, plain.params().bounds_min);
    std::copy_n(high, 3, plain.params().bounds_max);
    CHECK(sensitivityDistance(plain.view(), 0) == 0.75);
    plain.params().bounds_max[0] = std::numeric_limits<float>::infinity();
    CHECK(sensitivityDistance(plain.view(), 0) == 1);
    options.levels = 3;
    options.flags = kModelHasLevels;
    options.level_rule = LevelRule::Floor;
    SyntheticModel levels(options);
    levels.params().standard_dist = 12;
    levels.params().fork = 2;
    for (uint32_t c = 0; c < levels.view().params->chunk_count; ++c)
        CHECK(sensitivityDistance(levels.view(), c) == 12 / std::exp2(anchorLevel(levels.view(), c)));
    levels.params().standard_dist = 0; // unknown
    CHECK(sensitivityDistance(levels.view(), 0) == 1);
}
