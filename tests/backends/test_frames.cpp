// SPDX-License-Identifier: Apache-2.0
// Whole frames of a backend, held to others on models of every shape.
#include <gsc/error.h>
#include "tests/backends/backend.h"
#include "tests/kernels/synthetic_model.h"

#include <doctest/doctest.h>

#include <algorithm>

using namespace gsc;
using namespace gsc::test;

namespace {

const std::vector<EyeParams> kTwoEyes = {eyeAt(0.4f, -5, 150, 110), eyeAt(0.7f, -5, 150, 110)};

// Is every value of the picture this one?
bool isAll(Renderer& renderer, const EyeParams& eye, const FrameOptions& options, float wanted)
{
    const auto pixels = render(renderer, {eye}, options)[0].pixels;
    return std::all_of(pixels.begin(), pixels.end(), [&](float v) { return v == wanted; });
}

// This backend and the scalar reference.
std::vector<std::unique_ptr<Renderer>> withReference(const ModelView& model)
{
    std::vector<std::unique_ptr<Renderer>> both;
    for (const char* name : {kBackend.name, "cpu-reference"})
        both.push_back(open(model, name));
    return both;
}

} // namespace

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
            checkFrame(model.view(), kTwoEyes, onGrey());
        }
}

TEST_CASE("one decode for both eyes: what the scalar reference draws, and each anchor once")
{
    const std::vector<EyeParams> eyes = {eyeAt(-0.9f, -5, 150, 110), eyeAt(0.9f, -5, 130, 120)};
    for (const LevelRule rule : {LevelRule::None, LevelRule::Round, LevelRule::Progressive})
        for (const Tier tier : kBackend.tiers) {
            CAPTURE(uint32_t(rule));
            CAPTURE(uint32_t(tier));
            FrameOptions merged = mergedEyes(onGrey(tier));
            SyntheticOptions options = rule == LevelRule::None ? SyntheticOptions{} : octree(rule);
            options.anchors = 1500;
            options.inputs = kMlpTakesDistance;
            const SyntheticModel model(options);
            if (tier == kBackend.tiers[0])
                checkFrame(model.view(), eyes, merged);
            const auto renderer = open(model.view());
            const auto together = render(*renderer, eyes, merged), apart = render(*renderer, eyes, onGrey(tier));
            const EyeCounts* counts = together[0].result.eyes;
            CHECK(counts[0].anchors_decoded < counts[0].anchors_visible + counts[1].anchors_visible);
            CHECK(counts[1].anchors_decoded == 0);
            for (uint32_t e = 0; e < 2; ++e) {
                CHECK(compare(together[e].pixels, apart[e].pixels).psnr < 60); // the networks looked from elsewhere
                CHECK(counts[e].anchors_visible == apart[0].result.eyes[e].anchors_visible);
                CHECK(counts[e].anchors_visible < counts[0].anchors_decoded); // each sees some alone
            }
            const std::vector<EyeParams> one = {eyes[1]};
            CHECK(sameBytes(render(*renderer, one, merged), render(*renderer, one, onGrey(tier))));
        }
}

TEST_CASE("eyes whose axis is not in the middle of the image")
{
    for (const RasterRules raster : {RasterRules::DiffGaussian, RasterRules::Gsplat}) {
        CAPTURE(uint32_t(raster));
        SyntheticOptions options = octree(LevelRule::Round);
        options.raster_rules = raster;
        const SyntheticModel model(options);
        const EyeParams eye = eyeAt(0.4f, -5, 150, 110);
        checkFrame(model.view(), {offCentre(eye, -0.2f, 0.15f), offCentre(eye, 0.25f, 0.05f)}, onGrey());
        checkFrame(model.view(), {offCentre(eye, 0.9f, -0.2f)}, onGrey()); // the axis is outside the image
    }
}

TEST_CASE("anchors around a group of 128, a warp's 16 and none but one")
{
    for (const uint32_t anchors : {1u, 15u, 16u, 17u, 127u, 128u, 129u, 255u, 257u}) {
        CAPTURE(anchors);
        const SyntheticModel model({.anchors = anchors, .log_scale = -1.5f});
        checkFrame(model.view(), kTwoEyes, onGrey());
    }
}

TEST_CASE("image sizes that fill no bin, one bin exactly, a single row, column or pixel, and eyes that differ in size")
{
    const SyntheticModel model({.anchors = 900});
    for (const auto& [width, height] : {std::pair<uint32_t, uint32_t>{1, 1},
                                        {40, 1},
                                        {1, 30},
                                        {17, 3},
                                        {63, 31},
                                        {64, 32},
                                        {65, 33},
                                        {16, 200},
                                        {333, 97}}) {
        CAPTURE(width);
        CAPTURE(height);
        checkFrame(model.view(), {eyeAt(0.4f, -5, width, height)}, onGrey());
    }
    checkFrame(model.view(), {eyeAt(0.4f, -5, 150, 110), eyeAt(1.9f, -4, 97, 243)}, onGrey());
    checkFrame(model.view(), {eyeAt(0.4f, -5, 31, 40), eyeAt(-3.9f, -4, 197, 23)}, onGrey());
}

TEST_CASE("image sizes that splats cannot address are refused, and frames are drawn afterwards")
{
    const SyntheticModel model({.anchors = 50});
    for (const auto& renderer : withReference(model.view())) {
        EyeParams eye = eyeAt(0, -5, 16, 16);
        for (const auto& [width, height] : {std::pair<uint32_t, uint32_t>{0, 10}, {10, 0}, {65536, 1}, {1, 65536}}) {
            eye.width = width;
            eye.height = height;
            CHECK_THROWS_AS(render(*renderer, {&eye, 1}, FrameOptions{}, nullptr), Error);
        }
        CHECK(render(*renderer, kTwoEyes, onGrey())[0].result.eyes[0].gaussians_visible > 0);
    }
}

TEST_CASE("trap 24: an appearance row that does not exist, or is missing, is refused")
{
    SyntheticOptions options{.anchors = 20};
    const SyntheticModel without(options);
    options.appearance_dim = 4;
    options.appearance_rows = 2;
    options.inputs = kMlpTakesAppearance;
    const SyntheticModel model(options);
    for (const auto& [of, row] : {std::pair{&model, -1}, {&model, 2}, {&without, 0}})
        for (const auto& renderer : withReference(of->view())) {
            FrameOptions frame;
            frame.appearance = row;
            CHECK_THROWS_AS(render(*renderer, {eyeAt(0, -5, 32, 32)}, frame), Error);
        }
}

TEST_CASE(
    "trap 20: from within the model and close up, over white, with the near plane moved; the model's is the default")
{
    const SyntheticModel model({.anchors = 1500, .log_scale = -2});
    FrameOptions frame = over(1.0f);
    for (const float near_z : {0.0f, 1.5f}) {
        frame.near_z = near_z;
        for (const float z : {-5.0f, -3.0f, -1.0f}) {
            CAPTURE(z);
            checkFrame(model.view(), {eyeAt(0.2f, z, 150, 110), eyeAt(0.3f, z, 150, 110)}, frame);
        }
    }
    const auto renderer = open(model.view());
    const auto at = [&](float near_z) {
        frame.near_z = near_z;
        return render(*renderer, {eyeAt(0.1f, -1, 120, 90)}, frame)[0];
    };
    const auto standard = at(0), cut = at(2);
    CHECK(sameBytes(standard.pixels, at(0.2f).pixels));
    CHECK(cut.result.eyes[0].anchors_visible < standard.result.eyes[0].anchors_visible);
}

TEST_CASE("trap 25: no Gaussian at all is black even on a white background; one that lands nowhere is background")
{
    SyntheticOptions options{.anchors = 200};
    const SyntheticModel model(options);
    const float position[3] = {0, 0, -20}, away[3] = {0, 0, -40};
    const EyeParams blind = lookAt(position, away, 1, 70, 40), eye = eyeAt(0, -5, 70, 40);
    for (const Tier tier : kBackend.tiers) {
        FrameOptions white;
        white.tier = tier;
        std::fill_n(white.background, 3, 1.0f);
        for (const auto& renderer : withReference(model.view())) {
            CHECK(isAll(*renderer, blind, white, 0));
            white.empty_is_black = false;
            CHECK(isAll(*renderer, blind, white, 1));
            white.empty_is_black = true;
        }
        // opacities above zero but below 1/255: upstream draws nothing, yet it launches and shows the background
        std::vector<Mlp> mlps = randomMlps(options);
        std::fill(mlps[0].layers[1].weight.begin(), mlps[0].layers[1].weight.end(), 0.0f);
        for (const float opacity : {0.002f, 0.0f, -0.5f}) { // opacity 0 and below gives no Gaussian
            CAPTURE(opacity);
            std::fill(mlps[0].layers[1].bias.begin(), mlps[0].layers[1].bias.end(), opacity);
            const SyntheticModel faint(syntheticParams(options), randomAnchors(options), mlps, {}, 0);
            for (const auto& renderer : withReference(faint.view()))
                CHECK(isAll(*renderer, eye, white, opacity > 0 ? 1 : 0));
        }
    }
}

TEST_CASE("trap 12, trap 28: all anchors in one place, every Gaussian at one depth, drawn in source order")
{
    // 60 anchors: within a piece; 900 of them: 9,000 equal depths in a few bins, so the order itself is partitioned
    for (const uint32_t count : {60u, 900u}) {
        CAPTURE(count);
        SyntheticOptions options{.anchors = count, .log_scale = -3};
        SyntheticAnchors anchors = randomAnchors(options);
        for (size_t i = 1; i < count; ++i) // one cell, other features
            std::copy_n(anchors.position.begin(), 3, anchors.position.begin() + ptrdiff_t(3 * i));
        std::fill(anchors.offset.begin(), anchors.offset.end(), 0.0f); // and every Gaussian at the same depth
        const SyntheticModel model(syntheticParams(options), anchors, randomMlps(options), {}, 0);
        const EyeParams eye = eyeAt(0, -8, 200, 160);
        checkFrame(model.view(), {eye}, onGrey(), 90);
        const auto drawn = render(*open(model.view()), {eye}, onGrey());
        CHECK(drawn[0].result.eyes[0].anchors_visible == count);
        CHECK(sameBytes(render(*open(model.view(), 2), {eye}, onGrey()), drawn)); // nor do threads change the order
    }
}

TEST_CASE("images nobody wants may be null, all or one: the counts are those of a frame that is drawn")
{
    const SyntheticModel model(octree(LevelRule::Round, 500));
    const std::vector<EyeParams> eyes = {eyeAt(0.4f, -5, 90, 60), eyeAt(0.7f, -5, 120, 40)};
    for (const auto& renderer : withReference(model.view())) {
        const auto expected = render(*renderer, eyes, onGrey());
        FrameResult result = render(*renderer, eyes, onGrey(), nullptr);
        for (size_t e = 0; e < 2; ++e)
            CHECK(result.eyes[e].pairs == expected[0].result.eyes[e].pairs);
        std::vector<float> right(expected[1].pixels.size(), -7.0f);
        float* images[2] = {nullptr, right.data()};
        result = render(*renderer, eyes, onGrey(), images);
        CHECK(sameBytes(right, expected[1].pixels));
        CHECK(result.times.total > 0);
        CHECK(result.times.select + result.times.decode + result.times.bin + result.times.blend <=
              result.times.total * 1.001 + 0.002); // two clocks
    }
}

TEST_CASE("a fade or a hysteresis out of range is refused")
{
    const SyntheticModel model(octree(LevelRule::Round));
    for (const auto& renderer : withReference(model.view()))
        for (const float wrong : {-0.1f, 1.1f, NAN}) {
            FrameOptions fade, lag;
            fade.lod_fade = wrong;
            lag.lod_hysteresis = wrong;
            CHECK_THROWS_AS(render(*renderer, {eyeAt(0, -5, 32, 32)}, fade), Error);
            CHECK_THROWS_AS(render(*renderer, {eyeAt(0, -5, 32, 32)}, lag), Error);
        }
}
