// SPDX-License-Identifier: Apache-2.0
// Whole frames of the CUDA backend against the scalar reference, on models of every shape.
#include <gsc/error.h>
#include "tests/kernels/gpu_tools.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>

using namespace gsc;
using namespace gsc::test;

namespace {

const std::vector<EyeParams> kTwoEyes = {eyeAt(0.4f, -5, 150, 110), eyeAt(0.7f, -5, 150, 110)};

} // namespace

void gsc::test::checkFrame(const ModelView& model, const std::vector<EyeParams>& eyes, FrameOptions options,
                           double exact_db)
{
    Renderer& gpu = cudaRenderer();
    gpu.load(model);
    options.tier = Tier::Exact;
    const auto scalar = open(model, "cpu-reference");
    const auto expected = render(*scalar, eyes, options);
    const auto exact = render(gpu, eyes, options);
    CHECK_MESSAGE(sameBytes(exact, render(gpu, eyes, options)), "exact frames differ from run to run");
    options.tier = Tier::Fast;
    const auto fast = render(gpu, eyes, options);
    CHECK_MESSAGE(sameBytes(fast, render(gpu, eyes, options)), "fast frames differ from run to run");
    for (uint32_t e = 0; e < eyes.size(); ++e) {
        CAPTURE(e);
        const EyeCounts &want = expected[e].result.eyes[e], &got = exact[e].result.eyes[e];
        CHECK(got.anchors_visible == want.anchors_visible);
        CHECK(fast[e].result.eyes[e].anchors_visible == want.anchors_visible);
        CHECK(got.gaussians_dropped == want.gaussians_dropped);
        // an opacity on the edge of 1/255 may fall to either side: exp and tanh are not the same functions
        CHECK(double(got.gaussians_alive) == doctest::Approx(double(want.gaussians_alive)).epsilon(2e-3));
        CHECK(got.gaussians_visible <= want.gaussians_visible + want.gaussians_visible / 500);
        const Difference error = compare(exact[e].pixels, expected[e].pixels);
        const Difference loss = compare(fast[e].pixels, exact[e].pixels);
        if (std::getenv("GSC_TEST_VERBOSE") != nullptr)
            MESSAGE("exact ", error.psnr, " dB, fast ", loss.psnr, " dB, ", got.gaussians_visible, " splats");
        CHECK(error.psnr >= (exact_db > 0 ? exact_db : kBackend.exact_db));
        // a few pixels are no average
        CHECK(loss.psnr >= (exact[e].pixels.size() >= 15000 ? 60 : 45));
    }
}

TEST_CASE("features and offsets of every width; those the matrix units cannot take go through the scalar decode")
{
    for (const auto& shape : {std::pair<uint32_t, uint32_t>{32, 1},
                              {32, 4},
                              {32, 5},
                              {32, 9},
                              {32, 12},
                              {32, 13},
                              {16, 10},
                              {64, 10},
                              {48, 3},
                              {128, 40}}) {
        const uint32_t features = shape.first, offsets = shape.second;
        CAPTURE(features);
        CAPTURE(offsets);
        const SyntheticModel model({.anchors = 700, .feat_dim = features, .n_offsets = offsets, .log_scale = -2.4f});
        checkFrame(model.view(), kTwoEyes, onGrey(Tier::Exact));
    }
}

TEST_CASE("distance, level and appearance inputs, feature bank, float positions, finer cells")
{
    for (const uint32_t inputs : {0u, uint32_t(kMlpTakesDistance), uint32_t(kMlpTakesLevel),
                                  kMlpTakesDistance | kMlpTakesLevel | kMlpTakesAppearance})
        for (const uint32_t bank : {0u, uint32_t(kModelFeatureBank), kModelFeatureBank | kModelBankLevel,
                                    kModelFeatureBank | kModelBankDistance | kModelBankLevel}) {
            CAPTURE(inputs);
            CAPTURE(bank);
            SyntheticOptions options = octree(LevelRule::Round);
            options.anchors = 800;
            options.inputs = inputs;
            options.flags |= bank;
            if (inputs & kMlpTakesAppearance) {
                options.appearance_dim = 8;
                options.appearance_rows = 3;
            }
            options.encoding = bank == 0 ? PositionEncoding::Float : PositionEncoding::Grid;
            options.cell_log2 = bank == 0 ? 0 : 2;
            const SyntheticModel model(options);
            FrameOptions frame = onGrey(Tier::Exact);
            for (int row = options.appearance_dim > 0 ? 0 : -1; row < int(options.appearance_rows); ++row) {
                frame.appearance = row;
                checkFrame(model.view(), kTwoEyes, frame);
            }
        }
}

TEST_CASE("anchors with rotations of their own")
{
    SyntheticOptions options{.anchors = 900};
    SyntheticAnchors anchors = randomAnchors(options);
    Random random(77);
    for (uint32_t i = 0; i < 4 * options.anchors; ++i)
        anchors.rotation.push_back(random.normal());
    ModelParams params = syntheticParams(options);
    params.flags |= kModelHasRotation;
    const SyntheticModel model(params, anchors, randomMlps(options), {}, 0);
    checkFrame(model.view(), kTwoEyes, onGrey(Tier::Exact));
}

TEST_CASE("trap 15, trap 18: NaN features drop their anchor, infinities and points are survived")
{
    SyntheticOptions options{.anchors = 600, .log_scale = -2.5f};
    SyntheticAnchors anchors = randomAnchors(options);
    for (uint32_t i = 0; i < options.anchors; i += 7)
        anchors.feature[size_t(i) * options.feat_dim + i % options.feat_dim] = NAN;
    for (uint32_t i = 3; i < options.anchors; i += 7)
        anchors.offset[size_t(i) * 3 * options.n_offsets + i % 30] = i % 2 == 0 ? NAN : INFINITY;
    for (uint32_t i = 5; i < options.anchors; i += 7)
        anchors.scale[6 * size_t(i) + i % 6] = -INFINITY;
    const SyntheticModel model(syntheticParams(options), anchors, randomMlps(options), {}, 0);
    checkFrame(model.view(), kTwoEyes, onGrey(Tier::Exact));
}

TEST_CASE("depths that differ in their last bits only, in lists longer than a piece")
{
    const SyntheticModel model(
        {.anchors = 1200, .encoding = PositionEncoding::Float, .log_scale = -4, .extent = 0.001f});
    // exp() differs in its last bit, and so does here the order of many a pair; a wrong order of all is 40 dB away
    checkFrame(model.view(), {eyeAt(0, -8, 120, 90)}, onGrey(Tier::Exact), 65);
}

TEST_CASE("more anchors, splats and pairs than the first buffers hold: the frame is rendered again, whole")
{
    SyntheticOptions options;
    options.anchors = 11500; // more than 8,192 visible, more than 32,768 splats
    options.log_scale = -3.5f;
    const SyntheticModel model(options);
    const std::vector<EyeParams> eyes = {eyeAt(0.4f, -11, 400, 300)};
    const auto fresh = open(model.view()); // small buffers still
    const auto cpu = open(model.view(), "cpu", 0);
    const auto expected = render(*cpu, eyes, onGrey(Tier::Exact));
    const auto first = render(*fresh, eyes, onGrey(Tier::Fast));
    const auto exact = render(*fresh, eyes, onGrey(Tier::Exact));
    const auto again = render(*fresh, eyes, onGrey(Tier::Fast));
    CHECK(expected[0].result.eyes[0].anchors_visible > 8192);
    CHECK(expected[0].result.eyes[0].gaussians_visible > 32768);
    CHECK(exact[0].result.eyes[0].anchors_visible == expected[0].result.eyes[0].anchors_visible);
    CHECK(compare(exact[0].pixels, expected[0].pixels).psnr >= 85); // the fast CPU path is itself 85 dB from scalar
    CHECK(compare(first[0].pixels, exact[0].pixels).psnr >= 60);
    CHECK(sameBytes(first, again));
    CHECK(again[0].result.bytes_resident == exact[0].result.bytes_resident);
}

TEST_CASE("an image of more rows than bins can have is refused, and frames are drawn afterwards")
{
    const SyntheticModel model({.anchors = 50});
    Renderer& gpu = cudaRenderer();
    gpu.load(model.view());
    EyeParams eye = eyeAt(0, -5, 1, 8160);
    (void)render(gpu, {&eye, 1}, FrameOptions{}, nullptr);
    eye.height = 8161;
    CHECK_THROWS_AS(render(gpu, {&eye, 1}, FrameOptions{}, nullptr), Error);
    checkFrame(model.view(), kTwoEyes, onGrey(Tier::Exact));
}
