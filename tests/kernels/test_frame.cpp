// SPDX-License-Identifier: Apache-2.0
// Whole frames of the CPU: fast against scalar against double, one thread against several, two eyes against one.
#include <gsc/error.h>
#include "runtime/devices/graphics_card.h"
#include "tests/backends/backend.h"
#include "tests/kernels/simd_targets.h"
#include "tests/kernels/synthetic_model.h"

#include <doctest/doctest.h>

#include <algorithm>

using namespace gsc;
using namespace gsc::test;

// Fast on every instruction set, scalar and double agree. Scalar is slow: of eyes that are decoded each by itself, one.
void gsc::test::checkFrame(const ModelView& model, const std::vector<EyeParams>& all, FrameOptions options,
                           double exact_db)
{
    const bool merged = options.stereo == StereoMode::Merged;
    const std::vector<EyeParams> eyes = merged ? all : std::vector<EyeParams>{all.back()};
    const auto expected = render(*open(model, kBackend.judge), eyes, options);
    if (!merged)
        CHECK(compare(expected[0].pixels, render64(model, widen(eyes[0]), options).pixels).psnr > 80);
    forEachTarget([&](const char* target) {
        CAPTURE(target);
        const auto actual = render(*open(model, 1), eyes, options);
        for (size_t e = 0; e < eyes.size(); ++e) {
            CAPTURE(e);
            const EyeCounts &want = expected[e].result.eyes[e], &got = actual[e].result.eyes[e];
            const Difference d = compare(actual[e].pixels, expected[e].pixels);
            CHECK(d.psnr > (exact_db > 0 ? exact_db : kBackend.exact_db));
            CHECK(d.above <= 5);
            CHECK(got.anchors_visible == want.anchors_visible);
            CHECK(got.gaussians_alive == want.gaussians_alive);
            CHECK(got.gaussians_visible <= want.gaussians_visible);
            if (actual[e].pixels.size() < 15000)
                continue; // there are no tiles to leave out
            CHECK(got.pairs < want.pairs);
            CHECK(got.blend_evaluations < want.blend_evaluations);
        }
    });
}

TEST_CASE("images do not depend on the number of threads, byte for byte, nor on the frame before")
{
    const SyntheticModel model(octree(LevelRule::Round));
    const std::vector<EyeParams> eyes = {eyeAt(0.4f, -5, 190, 130), eyeAt(0.7f, -5, 190, 130)};
    FrameOptions merged = mergedEyes(onGrey());
    const auto one = open(model.view(), 1);
    const auto expected = render(*one, eyes, onGrey()), expected_merged = render(*one, eyes, merged);
    for (const int threads : {1, 2, 3, 5}) {
        const auto backend = open(model.view(), threads);
        for (uint32_t frame = 0; frame < 3; ++frame) {
            render(*backend, {eyeAt(-2, -3.0f - float(frame), 64 + 50 * frame, 90)}, onGrey());
            CHECK(sameBytes(render(*backend, eyes, onGrey()), expected));
        }
        CHECK(sameBytes(render(*backend, eyes, merged), expected_merged));
    }
}

TEST_CASE("two eyes in one call give what each gives alone")
{
    for (const uint32_t flags : {0u, kModelFeatureBank | kModelBankDistance}) {
        const SyntheticModel model({.anchors = 1200, .flags = flags, .inputs = kMlpTakesDistance});
        const std::vector<EyeParams> eyes = {eyeAt(0.4f, -5, 150, 110), eyeAt(1.9f, -4, 97, 143)};
        const auto backend = open(model.view(), 2);
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
        const auto backend = open(model.view(), 2);
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
    // a backend that this machine cannot run is passed over, with a warning if it has such a device, or refused by name
    std::string warning;
    makeRenderer({}, {1}, &warning);
    const bool has_cuda = usable[0].id.backend == "cuda";
    CHECK((warning.empty() || (!has_cuda && hasGraphicsCard(kNvidia))));
    if (!has_cuda)
        CHECK_THROWS_WITH_AS(makeRenderer({"cuda"}, {1}), doctest::Contains("cuda"), Error);
}

TEST_CASE("a later frame of the same size allocates nothing")
{
    const SyntheticModel model(octree(LevelRule::Round));
    const auto backend = open(model.view(), 1);
    const std::vector<EyeParams> eyes = {eyeAt(0.4f, -5, 190, 130), eyeAt(0.7f, -5, 190, 130)};
    const uint64_t first = render(*backend, eyes, onGrey())[0].result.bytes_resident;
    CHECK(first > 0);
    for (int i = 0; i < 3; ++i)
        CHECK(render(*backend, eyes, onGrey())[0].result.bytes_resident == first);
}
