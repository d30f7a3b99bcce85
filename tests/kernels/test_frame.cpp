// SPDX-License-Identifier: Apache-2.0
// Whole frames: fast against scalar against double, one thread against several, two eyes against one.
#include <gsc/error.h>
#include "tests/kernels/render_tools.h"
#include "tests/kernels/simd_targets.h"
#include "tests/kernels/synthetic_model.h"

#include <doctest/doctest.h>

#include <cstring>

using namespace gsc;
using namespace gsc::test;

namespace {

} // namespace

TEST_CASE("fast, scalar and double agree where the axis is not in the middle of the image")
{
    for (const RasterRules raster : {RasterRules::DiffGaussian, RasterRules::Gsplat}) {
        SyntheticOptions options = octree(LevelRule::Round);
        options.raster_rules = raster;
        const SyntheticModel model(options);
        for (const float lean : {-0.2f, 0.9f}) {
            CAPTURE(lean);
            const EyeParams eye = offCentre(eyeAt(0.4f, -5, 150, 110), lean, 0.15f);
            const auto scalar = renderWith(CpuPath::Reference, 1, model.view(), eye, onGrey());
            const auto wide = render64(model.view(), widen(eye), onGrey());
            CHECK(scalar.result.eyes[0].gaussians_visible > 100);
            CHECK(compare(scalar.pixels, wide.pixels).psnr > 80);
            const auto fast = renderWith(CpuPath::Fast, 1, model.view(), eye, onGrey());
            CHECK(compare(fast.pixels, scalar.pixels).psnr > 80);
        }
    }
}

TEST_CASE("fast, scalar and double agree for every level rule and both rasterisers")
{
    for (const RasterRules raster : {RasterRules::DiffGaussian, RasterRules::Gsplat})
        for (const LevelRule rule :
             {LevelRule::None, LevelRule::Floor, LevelRule::Round, LevelRule::Ceil, LevelRule::Progressive}) {
            SyntheticOptions options = rule == LevelRule::None ? SyntheticOptions{} : octree(rule);
            options.anchors = 1500;
            options.raster_rules = raster;
            const SyntheticModel model(options);
            const EyeParams eye = eyeAt(0.4f, -5, 150, 110);
            const auto scalar = renderWith(CpuPath::Reference, 1, model.view(), eye, onGrey());
            const auto wide = render64(model.view(), widen(eye), onGrey());
            CHECK(scalar.result.eyes[0].gaussians_visible > 500);
            CHECK(compare(scalar.pixels, wide.pixels).psnr > 80);
            forEachTarget([&](const char* target) {
                CAPTURE(target);
                const auto fast = renderWith(CpuPath::Fast, 1, model.view(), eye, onGrey());
                const Difference d = compare(fast.pixels, scalar.pixels);
                CHECK(d.psnr > 85);
                CHECK(d.above <= 5);
                CHECK(fast.result.eyes[0].anchors_visible == scalar.result.eyes[0].anchors_visible);
                CHECK(fast.result.eyes[0].gaussians_visible <= scalar.result.eyes[0].gaussians_visible);
                CHECK(fast.result.eyes[0].pairs < scalar.result.eyes[0].pairs);
                CHECK(fast.result.eyes[0].blend_evaluations < scalar.result.eyes[0].blend_evaluations);
            });
        }
}

TEST_CASE("images of a single row, column or pixel are drawn, and none of none")
{
    SyntheticOptions options;
    options.anchors = 500;
    const SyntheticModel model(options);
    for (const auto& [width, height] : {std::pair<uint32_t, uint32_t>{1, 1}, {40, 1}, {1, 30}, {17, 1}}) {
        CAPTURE(width);
        CAPTURE(height);
        const EyeParams eye = eyeAt(0.1f, -5, width, height);
        const auto fast = renderWith(CpuPath::Fast, 1, model.view(), eye, onGrey());
        CHECK(fast.pixels.size() == size_t(3) * width * height);
        CHECK(compare(fast.pixels, renderWith(CpuPath::Reference, 1, model.view(), eye, onGrey()).pixels).psnr > 80);
    }
    for (const auto& [width, height] : {std::pair<uint32_t, uint32_t>{0, 8}, {8, 0}, {65536, 1}, {1, 65536}}) {
        EyeParams eye = eyeAt(0.1f, -5, 8, 8);
        eye.width = width;
        eye.height = height;
        CHECK_THROWS_AS(renderWith(CpuPath::Fast, 1, model.view(), eye, onGrey()), Error);
    }
}

TEST_CASE("images do not depend on the number of threads, byte for byte, nor on the frame before")
{
    const SyntheticModel model(octree(LevelRule::Round));
    const std::vector<EyeParams> eyes = {eyeAt(0.4f, -5, 190, 130), eyeAt(0.7f, -5, 190, 130)};
    const std::unique_ptr<Renderer> one = makeCpuRenderer(CpuPath::Fast, 1);
    one->load(model.view());
    const auto expected = render(*one, eyes, onGrey());
    for (const int threads : {1, 2, 3, 5}) {
        const std::unique_ptr<Renderer> backend = makeCpuRenderer(CpuPath::Fast, threads);
        backend->load(model.view());
        for (int frame = 0; frame < 3; ++frame) {
            render(*backend, {eyeAt(-2, -3.0f - float(frame), 64 + 50 * uint32_t(frame), 90)}, onGrey());
            const auto images = render(*backend, eyes, onGrey());
            for (size_t e = 0; e < 2; ++e)
                CHECK(sameBytes(images[e].pixels, expected[e].pixels));
        }
    }
}

TEST_CASE("two eyes in one call give what each gives alone")
{
    for (const uint32_t flags : {0u, kModelFeatureBank | kModelBankDistance}) {
        SyntheticOptions options;
        options.anchors = 1200;
        options.flags = flags;
        options.inputs = kMlpTakesDistance;
        const SyntheticModel model(options);
        const std::vector<EyeParams> eyes = {eyeAt(0.4f, -5, 150, 110), eyeAt(1.9f, -4, 97, 143)};
        const std::unique_ptr<Renderer> backend = makeCpuRenderer(CpuPath::Fast, 2);
        backend->load(model.view());
        const auto both = render(*backend, eyes, onGrey());
        for (size_t e = 0; e < 2; ++e) {
            const auto alone = render(*backend, {eyes[e]}, onGrey())[0];
            // the features' part of the first layer is shared, and its sums go on in the same order
            CHECK(compare(both[e].pixels, alone.pixels).worst == 0);
            CHECK(both[e].result.eyes[e].anchors_visible == alone.result.eyes[0].anchors_visible);
            CHECK(both[e].result.eyes[e].gaussians_visible > 100);
        }
    }
}

TEST_CASE("levels that fade: fast, scalar and double agree, and no step of the camera changes much")
{
    for (const LevelRule rule : {LevelRule::Floor, LevelRule::Round, LevelRule::Ceil}) {
        CAPTURE(int(rule));
        const SyntheticModel model(octree(rule));
        FrameOptions soft = onGrey();
        soft.lod_fade = 0.5f;
        const EyeParams eye = eyeAt(0.4f, -5, 150, 110);
        const auto fast = renderWith(CpuPath::Fast, 1, model.view(), eye, soft);
        const auto scalar = renderWith(CpuPath::Reference, 1, model.view(), eye, soft);
        CHECK(compare(fast.pixels, scalar.pixels).psnr > 85);
        CHECK(compare(scalar.pixels, render64(model.view(), widen(eye), soft).pixels).psnr > 80);
        CHECK(fast.result.eyes[0].anchors_visible == scalar.result.eyes[0].anchors_visible);
        const auto hard = renderWith(CpuPath::Fast, 1, model.view(), eye, onGrey());
        CHECK(compare(fast.pixels, hard.pixels).psnr < 70);
        CHECK(fast.result.eyes[0].anchors_visible > hard.result.eyes[0].anchors_visible);

        // the levels' own share of the change of the picture: the camera stays and the bias moves
        const std::unique_ptr<Renderer> backend = makeCpuRenderer(CpuPath::Fast, 2);
        backend->load(model.view());
        double most[2] = {};
        for (const bool fades : {false, true}) {
            FrameOptions frame = onGrey();
            frame.lod_fade = fades ? 1.0f : 0.0f;
            std::vector<float> before;
            for (int i = 0; i < 40; ++i) {
                frame.lod_bias = -1 + 0.05f * float(i);
                const std::vector<float> now = render(*backend, {eye}, frame)[0].pixels;
                if (i > 0)
                    most[fades] = std::max(most[fades], compare(now, before).worst);
                before = now;
            }
        }
        CHECK(most[1] < 0.5 * most[0]);
    }
}

TEST_CASE("a fade or a hysteresis out of range is refused")
{
    const SyntheticModel model(octree(LevelRule::Round));
    const EyeParams eye = eyeAt(0, -5, 32, 32);
    for (const float wrong : {-0.1f, 1.1f, std::nanf("")})
        for (const CpuPath path : {CpuPath::Fast, CpuPath::Reference}) {
            FrameOptions fade, lag;
            fade.lod_fade = wrong;
            lag.lod_hysteresis = wrong;
            CHECK_THROWS_AS(renderWith(path, 1, model.view(), eye, fade), Error);
            CHECK_THROWS_AS(renderWith(path, 1, model.view(), eye, lag), Error);
        }
}

TEST_CASE("appearance rows, level and distance inputs change the picture and match the scalar path")
{
    SyntheticOptions options = octree(LevelRule::Floor);
    options.inputs = kMlpTakesDistance | kMlpTakesLevel | kMlpTakesAppearance;
    options.flags |= kModelFeatureBank | kModelBankLevel;
    options.appearance_dim = 8;
    options.appearance_rows = 2;
    const SyntheticModel model(options);
    const EyeParams eye = eyeAt(0.4f, -5, 150, 110);
    FrameOptions frame = onGrey();
    frame.appearance = 0;
    const auto first = renderWith(CpuPath::Fast, 2, model.view(), eye, frame);
    CHECK(compare(first.pixels, renderWith(CpuPath::Reference, 1, model.view(), eye, frame).pixels).psnr > 85);
    frame.appearance = 1;
    const auto second = renderWith(CpuPath::Fast, 2, model.view(), eye, frame);
    CHECK(compare(second.pixels, renderWith(CpuPath::Reference, 1, model.view(), eye, frame).pixels).psnr > 85);
    CHECK(compare(first.pixels, second.pixels).psnr < 60);
}

TEST_CASE("trap 24: an appearance row that does not exist, or is missing, is refused")
{
    SyntheticOptions options;
    options.anchors = 20;
    options.appearance_dim = 4;
    options.appearance_rows = 2;
    options.inputs = kMlpTakesAppearance;
    const SyntheticModel model(options);
    const EyeParams eye = eyeAt(0, -5, 32, 32);
    for (const int row : {-1, 2}) {
        FrameOptions frame;
        frame.appearance = row;
        CHECK_THROWS_AS(renderWith(CpuPath::Fast, 1, model.view(), eye, frame), Error);
        CHECK_THROWS_AS(renderWith(CpuPath::Reference, 1, model.view(), eye, frame), Error);
    }
    SyntheticOptions plain;
    plain.anchors = 20;
    const SyntheticModel without(plain);
    FrameOptions frame;
    frame.appearance = 0;
    CHECK_THROWS_AS(renderWith(CpuPath::Fast, 1, without.view(), eye, frame), Error);
}

TEST_CASE("trap 25: no Gaussian at all is black even on a white background; one that lands nowhere is background")
{
    SyntheticOptions options;
    options.anchors = 200;
    const SyntheticModel model(options);
    FrameOptions white;
    std::fill_n(white.background, 3, 1.0f);
    const float position[3] = {0, 0, -20}, away[3] = {0, 0, -40};
    const EyeParams blind = lookAt(position, away, 1, 40, 30);
    for (const CpuPath path : {CpuPath::Fast, CpuPath::Reference}) {
        for (const float value : renderWith(path, 1, model.view(), blind, white).pixels)
            CHECK(value == 0.0f);
        white.empty_is_black = false;
        for (const float value : renderWith(path, 1, model.view(), blind, white).pixels)
            CHECK(value == 1.0f);
        white.empty_is_black = true;
    }
    // opacities above zero but below 1/255: upstream draws nothing, yet it launches and shows the background
    std::vector<Mlp> mlps = randomMlps(options);
    for (float& w : mlps[0].layers[1].weight)
        w = 0;
    for (const float opacity : {0.002f, 0.0f, -0.5f}) { // of 0 and below there is no Gaussian
        CAPTURE(opacity);
        for (float& b : mlps[0].layers[1].bias)
            b = opacity;
        const SyntheticModel faint(syntheticParams(options), randomAnchors(options), mlps, {}, 0);
        for (const CpuPath path : {CpuPath::Fast, CpuPath::Reference})
            for (const float value : renderWith(path, 1, faint.view(), eyeAt(0, -5, 40, 30), white).pixels)
                CHECK(value == (opacity > 0 ? 1.0f : 0.0f));
    }
}

TEST_CASE("trap 20: the near plane can be moved, and the model's is the default")
{
    SyntheticOptions options;
    options.anchors = 1500;
    const SyntheticModel model(options);
    const EyeParams eye = eyeAt(0.1f, -1, 120, 90);
    FrameOptions frame = onGrey();
    const auto standard = renderWith(CpuPath::Fast, 1, model.view(), eye, frame);
    frame.near_z = 0.2f;
    CHECK(compare(standard.pixels, renderWith(CpuPath::Fast, 1, model.view(), eye, frame).pixels).worst == 0);
    frame.near_z = 2;
    const auto cut = renderWith(CpuPath::Fast, 1, model.view(), eye, frame);
    CHECK(cut.result.eyes[0].anchors_visible < standard.result.eyes[0].anchors_visible);
    CHECK(compare(cut.pixels, renderWith(CpuPath::Reference, 1, model.view(), eye, frame).pixels).psnr > 85);
}

TEST_CASE("trap 12, trap 28: duplicates of an anchor are all drawn, in source order")
{
    SyntheticOptions options;
    options.anchors = 60;
    SyntheticAnchors anchors = randomAnchors(options);
    for (size_t i = 1; i < 60; ++i) // one cell, other features
        std::copy_n(anchors.position.begin(), 3, anchors.position.begin() + ptrdiff_t(3 * i));
    for (float& offset : anchors.offset)
        offset = 0; // and every Gaussian at the same depth
    const SyntheticModel model(syntheticParams(options), anchors, randomMlps(options), {}, 0);
    const EyeParams eye = eyeAt(0, -8, 200, 160);
    const auto scalar = renderWith(CpuPath::Reference, 1, model.view(), eye, onGrey());
    CHECK(scalar.result.eyes[0].anchors_visible == 60);
    for (const int threads : {1, 2})
        CHECK(compare(renderWith(CpuPath::Fast, threads, model.view(), eye, onGrey()).pixels, scalar.pixels).psnr > 90);
}

TEST_CASE("a model of one anchor, and one of none in sight of either eye")
{
    SyntheticOptions options;
    options.anchors = 1;
    options.log_scale = -1;
    const SyntheticModel model(options);
    const EyeParams eye = eyeAt(0, -9, 33, 17);
    CHECK(compare(renderWith(CpuPath::Fast, 2, model.view(), eye, onGrey()).pixels,
                  renderWith(CpuPath::Reference, 1, model.view(), eye, onGrey()).pixels)
              .psnr > 90);
}

TEST_CASE("image sizes that splats cannot address are refused")
{
    SyntheticOptions options;
    options.anchors = 5;
    const SyntheticModel model(options);
    for (const auto& [width, height] : {std::pair<uint32_t, uint32_t>{0, 10}, {10, 0}, {65536, 1}, {1, 70000}})
        for (const char* name : {"cpu", "cpu-reference"}) {
            const std::unique_ptr<Renderer> backend = makeRenderer({name}, {1});
            backend->load(model.view());
            EyeParams eye = eyeAt(0, -5, 16, 16);
            eye.width = width;
            eye.height = height;
            CHECK_THROWS_AS(render(*backend, {&eye, 1}, FrameOptions{}, nullptr), Error);
        }
}

TEST_CASE("images nobody wants may be null, all or one")
{
    const SyntheticModel model(octree(LevelRule::Round));
    const std::vector<EyeParams> eyes = {eyeAt(0.4f, -5, 90, 60), eyeAt(0.7f, -5, 120, 40)};
    for (const CpuPath path : {CpuPath::Fast, CpuPath::Reference}) {
        const std::unique_ptr<Renderer> backend = makeCpuRenderer(path, 2);
        backend->load(model.view());
        const auto expected = render(*backend, eyes, onGrey());
        FrameResult result = render(*backend, eyes, onGrey(), nullptr);
        for (int e = 0; e < 2; ++e)
            CHECK(result.eyes[e].pairs == expected[0].result.eyes[e].pairs);
        std::vector<float> right(expected[1].pixels.size(), -7.0f);
        float* images[2] = {nullptr, right.data()};
        result = render(*backend, eyes, onGrey(), images);
        CHECK(compare(right, expected[1].pixels).worst == 0);
    }
}

TEST_CASE("a backend says what it runs on")
{
    const std::unique_ptr<Renderer> backend = makeCpuRenderer(CpuPath::Fast, 3);
    CHECK(backend->device().processors == 3);
    CHECK(backend->device().memory_bytes > 0);
    CHECK(makeCpuRenderer(CpuPath::Reference, 0)->device().processors == 1);
}

TEST_CASE("backends are listed, made by name, and a wrong name is refused with the list")
{
    std::vector<DeviceInfo> usable = devices();
    std::erase_if(usable, [](const DeviceInfo& device) { return !device.usable; });
    REQUIRE(usable.size() >= 2);
    for (const DeviceInfo& device : usable)
        CHECK(makeRenderer(device.id, {1})->id() == device.id);
    CHECK(makeRenderer({}, {1})->id() == usable[0].id);
    CHECK_THROWS_WITH_AS(makeRenderer({"abacus"}, {1}), doctest::Contains("cpu-reference"), Error);
    CHECK_THROWS_WITH_AS(makeRenderer({"cpu", 1}), doctest::Contains("has 1 of its devices"), Error);
    // a backend that this machine cannot run is passed over with a warning, or refused by name
    std::string warning;
    makeRenderer({}, {1}, &warning);
    const bool has_cuda = usable[0].id.backend == "cuda";
    CHECK((warning.empty() || !has_cuda));
    if (!has_cuda)
        CHECK_THROWS_WITH_AS(makeRenderer({"cuda"}, {1}), doctest::Contains("cuda"), Error);
}

TEST_CASE("a later frame of the same size allocates nothing")
{
    const SyntheticModel model(octree(LevelRule::Round));
    const std::unique_ptr<Renderer> backend = makeCpuRenderer(CpuPath::Fast, 1);
    backend->load(model.view());
    const std::vector<EyeParams> eyes = {eyeAt(0.4f, -5, 190, 130), eyeAt(0.7f, -5, 190, 130)};
    const uint64_t first = render(*backend, eyes, onGrey())[0].result.bytes_resident;
    CHECK(first > 0);
    for (int i = 0; i < 3; ++i)
        CHECK(render(*backend, eyes, onGrey())[0].result.bytes_resident == first);
}
