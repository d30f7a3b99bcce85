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
    const std::unique_ptr<Renderer> scalar = makeCpuRenderer(CpuPath::Reference, 1);
    scalar->load(model);
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
        CHECK(error.psnr >= exact_db);
        // a few pixels are no average
        CHECK(loss.psnr >= (exact[e].pixels.size() >= 15000 ? 60 : 45));
    }
}

TEST_CASE("every level rule and both rasterisers")
{
    for (const RasterRules raster : {RasterRules::DiffGaussian, RasterRules::Gsplat})
        for (const LevelRule rule :
             {LevelRule::None, LevelRule::Floor, LevelRule::Round, LevelRule::Ceil, LevelRule::Progressive}) {
            CAPTURE(uint32_t(raster));
            CAPTURE(uint32_t(rule));
            SyntheticOptions options = rule == LevelRule::None ? SyntheticOptions{} : octree(rule);
            options.anchors = 1500;
            options.raster_rules = raster;
            const SyntheticModel model(options);
            checkFrame(model.view(), kTwoEyes, onGrey(Tier::Exact));
        }
}

TEST_CASE("one decode for both eyes: what the scalar reference draws, and each anchor once")
{
    FrameOptions merged = onGrey(Tier::Exact);
    merged.stereo = StereoMode::Merged;
    const std::vector<EyeParams> eyes = {eyeAt(-0.9f, -5, 150, 110), eyeAt(0.9f, -5, 130, 120)};
    for (const LevelRule rule : {LevelRule::None, LevelRule::Round, LevelRule::Progressive}) {
        CAPTURE(uint32_t(rule));
        SyntheticOptions options = rule == LevelRule::None ? SyntheticOptions{} : octree(rule);
        options.anchors = 1500;
        const SyntheticModel model(options);
        checkFrame(model.view(), eyes, merged);
        for (const Tier tier : {Tier::Exact, Tier::Fast}) {
            CAPTURE(uint32_t(tier));
            merged.tier = tier;
            const auto together = render(cudaRenderer(), eyes, merged),
                       apart = render(cudaRenderer(), eyes, onGrey(tier));
            const EyeCounts* counts = together[0].result.eyes;
            CHECK(counts[0].anchors_decoded < counts[0].anchors_visible + counts[1].anchors_visible);
            CHECK(counts[0].anchors_decoded >= std::max(counts[0].anchors_visible, counts[1].anchors_visible));
            CHECK(counts[1].anchors_decoded == 0);
            for (uint32_t e = 0; e < 2; ++e) // the networks looked from elsewhere
                CHECK(compare(together[e].pixels, apart[e].pixels).psnr < 60);
            const std::vector<EyeParams> one = {eyes[1]};
            CHECK(sameBytes(render(cudaRenderer(), one, merged), render(cudaRenderer(), one, onGrey(tier))));
        }
        merged.tier = Tier::Exact;
    }
}

TEST_CASE("eyes whose axis is not in the middle of the image")
{
    for (const RasterRules raster : {RasterRules::DiffGaussian, RasterRules::Gsplat}) {
        CAPTURE(uint32_t(raster));
        SyntheticOptions options = octree(LevelRule::Round);
        options.anchors = 1500;
        options.raster_rules = raster;
        const SyntheticModel model(options);
        const EyeParams eye = eyeAt(0.4f, -5, 150, 110);
        checkFrame(model.view(), {offCentre(eye, -0.15f, 0.1f), offCentre(eye, 0.25f, 0.05f)}, onGrey(Tier::Exact));
        checkFrame(model.view(), {offCentre(eye, 0.9f, -0.2f)}, onGrey(Tier::Exact)); // the axis is outside the image
    }
}

TEST_CASE("anchors around a group of 128, a warp's 16 and none but one")
{
    for (const uint32_t anchors : {1u, 15u, 16u, 17u, 127u, 128u, 129u, 255u, 257u}) {
        CAPTURE(anchors);
        SyntheticOptions options;
        options.anchors = anchors;
        options.log_scale = -1.5f;
        const SyntheticModel model(options);
        checkFrame(model.view(), kTwoEyes, onGrey(Tier::Exact));
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
        SyntheticOptions options;
        options.anchors = 700;
        options.feat_dim = features;
        options.n_offsets = offsets;
        options.log_scale = -2.4f;
        const SyntheticModel model(options);
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
    SyntheticOptions options;
    options.anchors = 900;
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
    SyntheticOptions options;
    options.anchors = 600;
    options.log_scale = -2.5f;
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

TEST_CASE("image sizes that fill no bin, one bin exactly, and eyes that differ in size")
{
    SyntheticOptions options;
    options.anchors = 900;
    const SyntheticModel model(options);
    for (const auto& size :
         {std::pair<uint32_t, uint32_t>{1, 1}, {17, 3}, {63, 31}, {64, 32}, {65, 33}, {16, 200}, {333, 97}}) {
        const uint32_t width = size.first, height = size.second;
        CAPTURE(width);
        CAPTURE(height);
        checkFrame(model.view(), {eyeAt(0.4f, -5, width, height)}, onGrey(Tier::Exact));
    }
    checkFrame(model.view(), {eyeAt(0.4f, -5, 150, 110), eyeAt(1.9f, -4, 97, 243)}, onGrey(Tier::Exact));
    checkFrame(model.view(), {eyeAt(0.4f, -5, 31, 40), eyeAt(-3.9f, -4, 197, 23)}, onGrey(Tier::Exact));
}

TEST_CASE("from within the model and close up, over a white background, with the near plane moved")
{
    SyntheticOptions options;
    options.anchors = 1500;
    options.log_scale = -2;
    const SyntheticModel model(options);
    FrameOptions frame;
    std::fill_n(frame.background, 3, 1.0f);
    for (const float near_z : {0.0f, 1.5f}) {
        frame.near_z = near_z;
        for (const float z : {-5.0f, -3.0f, -1.0f}) {
            CAPTURE(z);
            checkFrame(model.view(), {eyeAt(0.2f, z, 150, 110), eyeAt(0.3f, z, 150, 110)}, frame);
        }
    }
}

TEST_CASE("trap 25: black where there is no Gaussian at all, background where none lands")
{
    SyntheticOptions options;
    options.anchors = 200;
    const SyntheticModel model(options);
    const float position[3] = {0, 0, -20}, away[3] = {0, 0, -40};
    const EyeParams blind = lookAt(position, away, 1, 70, 40);
    std::vector<Mlp> mlps = randomMlps(options);
    for (float& w : mlps[0].layers[1].weight)
        w = 0;
    for (float& b : mlps[0].layers[1].bias)
        b = 0.002f; // above zero, below 1/255
    const SyntheticModel faint(syntheticParams(options), randomAnchors(options), mlps, {}, 0);
    for (const Tier tier : {Tier::Exact, Tier::Fast}) {
        FrameOptions white;
        white.tier = tier;
        std::fill_n(white.background, 3, 1.0f);
        Renderer& gpu = cudaRenderer();
        gpu.load(model.view());
        const auto all = [&](const EyeParams& eye, float wanted) {
            const auto pixels = render(gpu, {eye}, white)[0].pixels;
            return std::all_of(pixels.begin(), pixels.end(), [&](float v) { return v == wanted; });
        };
        CHECK(all(blind, 0.0f));
        white.empty_is_black = false;
        CHECK(all(blind, 1.0f));
        white.empty_is_black = true;
        gpu.load(faint.view());
        CHECK(all(eyeAt(0, -5, 70, 40), 1.0f));
    }
}

TEST_CASE("trap 12, trap 28: all anchors in one place, every Gaussian at one depth, drawn in source order")
{
    // 60 anchors: within a piece; 900 of them: 9,000 equal depths in a few bins, so the order itself is partitioned
    for (const uint32_t count : {60u, 900u}) {
        CAPTURE(count);
        SyntheticOptions options;
        options.anchors = count;
        options.log_scale = -3;
        SyntheticAnchors anchors = randomAnchors(options);
        for (size_t i = 1; i < count; ++i)
            std::copy_n(anchors.position.begin(), 3, anchors.position.begin() + ptrdiff_t(3 * i));
        for (float& offset : anchors.offset)
            offset = 0;
        const SyntheticModel model(syntheticParams(options), anchors, randomMlps(options), {}, 0);
        checkFrame(model.view(), {eyeAt(0, -8, 200, 160)}, onGrey(Tier::Exact));
    }
}

TEST_CASE("depths that differ in their last bits only, in lists longer than a piece")
{
    SyntheticOptions options;
    options.anchors = 1200;
    options.extent = 0.001f;
    options.log_scale = -4;
    options.encoding = PositionEncoding::Float;
    const SyntheticModel model(options);
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
    const std::unique_ptr<Renderer> fresh = makeRenderer({"cuda"}); // small buffers still
    fresh->load(model.view());
    const std::unique_ptr<Renderer> cpu = makeCpuRenderer(CpuPath::Fast, 0);
    cpu->load(model.view());
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

TEST_CASE("null images: nothing is copied, the counts are those of a frame that is")
{
    SyntheticOptions options;
    const SyntheticModel model(options);
    Renderer& gpu = cudaRenderer();
    gpu.load(model.view());
    const auto with = render(gpu, kTwoEyes, onGrey(Tier::Fast));
    FrameResult result = render(gpu, kTwoEyes, onGrey(Tier::Fast), nullptr);
    CHECK(result.eyes[1].pairs == with[1].result.eyes[1].pairs);
    std::vector<float> right(with[1].pixels.size(), -7.0f);
    float* images[2] = {nullptr, right.data()};
    result = render(gpu, kTwoEyes, onGrey(Tier::Fast), images);
    CHECK(std::memcmp(right.data(), with[1].pixels.data(), right.size() * sizeof(float)) == 0);
    CHECK(result.times.total > 0);
    CHECK(result.times.select + result.times.decode + result.times.bin + result.times.blend <=
          result.times.total * 1.001 + 0.002); // two clocks
}

TEST_CASE("what the backend cannot render is refused, and it renders afterwards")
{
    SyntheticOptions options;
    options.anchors = 50;
    const SyntheticModel model(options);
    Renderer& gpu = cudaRenderer();
    gpu.load(model.view());
    for (const auto& [width, height] : {std::pair<uint32_t, uint32_t>{0, 10}, {10, 0}, {65536, 1}, {1, 8161}}) {
        EyeParams eye = eyeAt(0, -5, 16, 16);
        eye.width = width;
        eye.height = height;
        CHECK_THROWS_AS(render(gpu, {&eye, 1}, FrameOptions{}, nullptr), Error);
    }
    FrameOptions rows;
    rows.appearance = 0;
    const EyeParams eye = eyeAt(0, -5, 16, 16);
    CHECK_THROWS_AS(render(gpu, {&eye, 1}, rows, nullptr), Error);
    checkFrame(model.view(), kTwoEyes, onGrey(Tier::Exact));
}
