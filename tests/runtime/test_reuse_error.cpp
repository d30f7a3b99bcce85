// SPDX-License-Identifier: Apache-2.0
// The policy of error: what it predicts, what it decodes, and that pictures stay within its bound.
#include <gsc/half.h>
#include "kernels/reuse/reuse_math.h"
#include "kernels/reuse/schedule.h"
#include "tests/backends/reuse_scene.h"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>

using namespace gsc;
using namespace gsc::test;

namespace {

// One strip of small Gaussians that a camera has seen once, and then from elsewhere.
struct StepScene {
    std::vector<uint16_t> sensitivity = std::vector<uint16_t>(2 * kStripAnchors, 0x3c00); // 1
    SyntheticModel model{[] {
        SyntheticOptions options{.anchors = kStripAnchors, .log_scale = -8, .extent = 0.3f, .seed = 3};
        return options;
    }()};
    ModelView view = model.view();
    std::vector<EyeParams> before = walk(0, 1), after = walk(1, 1);

    StepScene() { view.sensitivity = sensitivity.data(); }

    // Predicted change of the strip, in 1/255.
    [[nodiscard]] float change() const
    {
        StripAnchors anchors;
        loadStripAnchors(view, view.sensitivity, view.groups[0], 0, anchors);
        return 255 * stripError(anchors, 0xffffu, before[0].center, after[0].center);
    }
    // Anchors that the second frame decodes where `bound` is allowed.
    uint64_t decoded(Renderer& backend, float bound) const
    {
        FrameOptions options;
        options.reuse.policy = ReusePolicy::Error;
        options.reuse.bound = bound;
        backend.load(view);
        for (int i = 0; i < 3; ++i) // a camera that stood still is on no way
            render(backend, before, options);
        return render(backend, after, options)[0].result.eyes[0].anchors_decoded;
    }
};

} // namespace

TEST_CASE("the error policy decodes less the larger its bound and stays close to the truth")
{
    const SyntheticModel model(modelOptions(LevelRule::None));
    uint64_t before = std::numeric_limits<uint64_t>::max();
    for (const float bound : {0.0f, 2.0f, 8.0f, 32.0f}) {
        CAPTURE(bound);
        const auto plain = open(model.view()), reusing = open(model.view());
        uint64_t decoded = 0;
        double worst = 1000;
        for (int i = 0; i < 12; ++i) {
            const auto actual = render(*reusing, walk(i, 1), with(ReusePolicy::Error, bound));
            const auto expected = render(*plain, walk(i, 1), with(ReusePolicy::None));
            decoded += actual[0].result.eyes[0].anchors_decoded;
            worst = std::min(worst, compare(actual[0].pixels, expected[0].pixels).psnr);
        }
        CHECK(decoded < before);
        CHECK(worst > (bound > 8 ? 25 : 40));
        before = decoded;
    }
}

TEST_CASE("a strip is decoded again when its predicted change is above the bound, and not before")
{
    const StepScene scene;
    const auto backend = makeCpuRenderer(CpuPath::Fast, 1);
    CHECK(scene.change() > 0.2f);
    CHECK(scene.decoded(*backend, 0.98f * scene.change()) == kStripAnchors);
    CHECK(scene.decoded(*backend, 1.02f * scene.change()) == 0);
}

TEST_CASE("what is seen for the first time is decoded well whatever the budget")
{
    SyntheticOptions many = modelOptions(LevelRule::None);
    many.anchors = 4000;
    const SyntheticModel model(many);
    const auto plain = open(model.view()), reusing = open(model.view());
    FrameOptions options = with(ReusePolicy::Error, 1);
    options.reuse.decode_budget = 16;
    for (int i = 0; i < 10; ++i)
        (void)render(*reusing, walk(i, 1), options);
    // looks elsewhere from the next place of the walk
    std::vector<EyeParams> eyes = walk(10, 1);
    const float target[3] = {9, 2, -4};
    eyes = {lookAt(eyes[0].center, target, 0.9f, 120, 90)};
    const auto actual = render(*reusing, eyes, options);
    CHECK(actual[0].result.eyes[0].anchors_decoded > 100);
    CHECK(compare(actual[0].pixels, render(*plain, eyes, with(ReusePolicy::None))[0].pixels).psnr > 50);
}

TEST_CASE("on a straight way entries are drawn between two keys: fewer decodes and less error than the paper's depth")
{
    const SyntheticModel model(modelOptions(LevelRule::None));
    const auto measure = [&](const FrameOptions& options, uint64_t& decoded) {
        const auto plain = open(model.view()), reusing = open(model.view());
        double worst = 1000;
        decoded = 0;
        for (int i = 0; i < 24; ++i) {
            const auto actual = render(*reusing, walk(i, 1), options);
            const auto expected = render(*plain, walk(i, 1), with(ReusePolicy::None));
            decoded += i > 0 ? actual[0].result.eyes[0].anchors_decoded : 0;
            worst = std::min(worst, compare(actual[0].pixels, expected[0].pixels).psnr);
        }
        return worst;
    };
    uint64_t by_depth = 0, by_error = 0;
    const double depth = measure(with(ReusePolicy::Depth, 0, 5), by_depth);
    const double error = measure(with(ReusePolicy::Error, 1), by_error);
    CHECK(by_error < by_depth);
    CHECK(error > depth + 10);
}

TEST_CASE("a camera that turns back is drawn within the bound too")
{
    const SyntheticModel model(modelOptions(LevelRule::None));
    const auto plain = open(model.view()), reusing = open(model.view());
    for (int i = 0; i < 24; ++i) {
        CAPTURE(i);
        const int at = i % 8 < 4 ? i % 8 : 8 - i % 8; // to and fro, with a jump now and then
        const std::vector<EyeParams> eye = walk(at + (i > 16 ? 40 : 0), 1);
        const auto actual = render(*reusing, eye, with(ReusePolicy::Error, 4));
        const auto expected = render(*plain, eye, with(ReusePolicy::None));
        CHECK(compare(actual[0].pixels, expected[0].pixels).psnr > 45);
    }
}

// Anchors that pass beside the camera change fast and are not seen: they cause no decoding. Once the camera turns to
// them, they are held to the bound like all others.
TEST_CASE("anchors that are not seen make nothing due, and are drawn within the bound when they come into view")
{
    SyntheticOptions of = modelOptions(LevelRule::None);
    of.anchors = 3000;
    const SyntheticModel model(of);
    const auto plain = open(model.view()), reusing = open(model.view());
    uint64_t decoded = 0, visible = 0;
    for (int i = 0; i < 40; ++i) {
        CAPTURE(i);
        const float position[3] = {0.1f, 0.2f, -2 + 0.02f * float(i)};
        const float turn = i > 32 ? 1.5f : 0.0f;
        const float target[3] = {0.1f + std::sin(turn), 0.2f, position[2] + std::cos(turn)};
        const std::vector<EyeParams> eye = {lookAt(position, target, 0.9f, 120, 90)};
        const auto actual = render(*reusing, eye, with(ReusePolicy::Error, 4));
        const auto expected = render(*plain, eye, with(ReusePolicy::None));
        const double psnr = compare(actual[0].pixels, expected[0].pixels).psnr;
        CHECK(psnr > (i > 32 ? 54 : 45));
        const EyeCounts& counts = actual[0].result.eyes[0];
        if (i >= 8 && i <= 32) {
            decoded += counts.anchors_decoded;
            visible += counts.anchors_visible;
        }
    }
    CHECK(double(decoded) < 0.07 * double(visible));
}

// A pixel of a picture of 8 x 6 is a fiftieth of it, so that there every Gaussian is broad.
TEST_CASE("Gaussians that take much of the picture are decoded again sooner, and show less error for it")
{
    const SyntheticModel model(modelOptions(LevelRule::None));
    const auto measure = [&](uint32_t width, uint32_t height) {
        const auto plain = open(model.view()), reusing = open(model.view());
        uint64_t decoded = 0;
        double worst = 1000;
        for (int i = 0; i < 24; ++i) {
            const float position[3] = {0.2f + 0.02f * float(i), 0.3f, -5};
            const float target[3] = {0.1f, -0.2f, 0.3f};
            const std::vector<EyeParams> eye = {lookAt(position, target, 0.9f, width, height)};
            const auto actual = render(*reusing, eye, with(ReusePolicy::Error, 4));
            decoded += i > 0 ? actual[0].result.eyes[0].anchors_decoded : 0;
            const auto expected = render(*plain, eye, with(ReusePolicy::None));
            worst = std::min(worst, compare(actual[0].pixels, expected[0].pixels).psnr);
        }
        return std::pair<uint64_t, double>(decoded, worst);
    };
    const auto wide = measure(120, 90), tiny = measure(8, 6);
    CHECK(wide.first > 0);
    CHECK(double(tiny.first) > 1.2 * double(wide.first));
    CHECK(tiny.second > wide.second + 3);
}

TEST_CASE("an eye that draws the other's entry of a broad Gaussian is held to as little")
{
    const SyntheticModel model(modelOptions(LevelRule::None));
    const auto plain = open(model.view()), reusing = open(model.view());
    double worst = 1000;
    for (int i = 0; i < 40; ++i) {
        std::vector<EyeParams> eyes;
        for (int e = 0; e < 2; ++e) { // how far apart they are swings
            const float apart = float(e) * (0.05f + 0.05f * std::sin(0.3f * float(i)));
            const float position[3] = {0.2f + 0.02f * float(i) + apart, 0.3f, -5};
            const float target[3] = {position[0], 0.3f, 0.3f};
            eyes.push_back(lookAt(position, target, 0.9f, 8, 6));
        }
        const auto actual = render(*reusing, eyes, with(ReusePolicy::Error, 8));
        const auto expected = render(*plain, eyes, with(ReusePolicy::None));
        worst = std::min(worst, compare(actual[1].pixels, expected[1].pixels).psnr);
    }
    CHECK(worst > 62); // 63.9 measured, 60.0 where only an eye with an entry of its own is
}

TEST_CASE("what is left of the bound keeps the mean square error of the broadest Gaussian at that of one of kBroad")
{
    CHECK(broadShare(0) == 1);
    CHECK(broadShare(kBroad) == 1);
    for (const float cover : {0.03f, 0.2f, 1.0f})
        CHECK(broadShare(cover) * broadShare(cover) * cover == doctest::Approx(kBroad));
}

TEST_CASE("a needle counts by how much thinner it is than a sensitivity takes it for")
{
    const float round[3] = {0.01f, 0, 0.01f};
    CHECK(thinness(round, 0.1f) == 1);
    const float tenth[3] = {1, 0, 0.01f}, thirtieth[3] = {1, 0, 1 / 900.0f};
    CHECK(thinness(tenth, 0.1f) == doctest::Approx(1).epsilon(0.03));
    CHECK(thinness(thirtieth, 0.1f) == doctest::Approx(9).epsilon(0.01));
    const float mean = 0.5f + 1 / 1800.0f, turned[3] = {mean, 1 - mean, mean}; // the same at 45 degrees
    CHECK(thinness(turned, 0.1f) == doctest::Approx(9).epsilon(0.01));
    const float flat[3] = {1, 1, 1}, wrong[3] = {1, 2, 1}, unknown[3] = {NAN, 0, 1};
    for (const float* conic : {flat, wrong, unknown})
        CHECK(thinness(conic, 0.1f) == kThinnest);
}

TEST_CASE("a way that bends is decoded little more often than a straight one")
{
    const SyntheticModel model(modelOptions(LevelRule::None));
    const auto count = [&](float bend) {
        const auto backend = open(model.view());
        uint64_t decoded = 0;
        for (int i = 0; i < 48; ++i) {
            const float angle = bend * float(i); // round the model, or along the tangent
            const float position[3] = {bend > 0 ? 5 * std::sin(angle) : 0.02f * float(i), 0.3f,
                                       bend > 0 ? -5 * std::cos(angle) : -5.0f};
            const float target[3] = {0.1f, -0.2f, 0.3f};
            const std::vector<EyeParams> eye = {lookAt(position, target, 0.9f, 120, 90)};
            const auto image = render(*backend, eye, with(ReusePolicy::Error, 1));
            decoded += i > 4 ? image[0].result.eyes[0].anchors_decoded : 0;
        }
        return decoded;
    };
    const uint64_t straight = count(0), round = count(0.004f);
    CHECK(straight > 0);
    CHECK(double(round) < 1.5 * double(straight));
}

TEST_CASE("predicted changes of a strip are the scalar rule's, the largest of the lanes asked for")
{
    const SyntheticModel synthetic(modelOptions(LevelRule::None));
    const ModelView& model = synthetic.view();
    std::vector<uint16_t> halves(2 * 1200);
    for (size_t i = 0; i < halves.size(); ++i)
        halves[i] = floatToHalfUp(0.001f * float(i % 97));
    const float c0[3] = {0.3f, -0.1f, -5}, c1[3] = {0.4f, 0.1f, -4.8f};
    for (uint64_t g = 0; g < model.params->group_count; ++g)
        for (uint32_t strip = 0; strip * kStripAnchors < model.groups[g].anchor_count; ++strip) {
            StripAnchors anchors;
            loadStripAnchors(model, halves.data(), model.groups[g], strip, anchors);
            for (const uint32_t lanes : {0xffffu, 0x0001u, 0x8000u, 0x0f30u}) {
                double expected = 0;
                for (uint32_t i = 0; i < kStripAnchors; ++i)
                    if (lanes >> i & 1)
                        expected =
                            std::max(expected, double(predictedChange({anchors.x[i], anchors.y[i], anchors.z[i]}, c0,
                                                                      c1, anchors.direction[i], anchors.distance[i])));
                CHECK(double(stripError(anchors, lanes, c0, c1)) == doctest::Approx(expected).epsilon(1e-4));
            }
            const float on[3] = {anchors.x[5], anchors.y[5], anchors.z[5]};
            CHECK(std::isinf(stripError(anchors, 1u << 5, on, c1)));
            CHECK(std::isinf(stripError(anchors, 1u << 5, c0, on)));
            CHECK(stripError(anchors, 0xffff, c0, c0) == 0);
        }
    for (const float v : {0.0f, 1e-7f, 6.1e-5f, 0.1f, 1.0f, 1.0003f, 2047.5f, 65503.0f}) {
        CHECK(halfValue(floatToHalfUp(v)) >= v);
        CHECK(halfValue(floatToHalfUp(v)) <= v * 1.001f + 6e-8f);
    }
    CHECK(halfValue(floatToHalfUp(INFINITY)) == 65504);
    CHECK(halfValue(floatToHalfUp(NAN)) == 65504);
}

TEST_CASE("the bound of a change is never below it, and little above it for small steps")
{
    const SyntheticModel synthetic(modelOptions(LevelRule::None));
    const ModelView& model = synthetic.view();
    std::vector<uint16_t> halves(2 * 1200);
    for (size_t i = 0; i < halves.size(); ++i)
        halves[i] = floatToHalfUp(0.001f * float(i % 97));
    uint32_t state = 1;
    const auto random = [&state] {
        state = state * 1664525u + 1013904223u;
        return float(state >> 8) * 0x1p-23f - 1;
    };
    uint64_t told = 0, near = 0;
    for (uint64_t g = 0; g < model.params->group_count; ++g) {
        const uint32_t strips = (model.groups[g].anchor_count + kStripAnchors - 1) / kStripAnchors;
        for (int i = 0; i < 400; ++i) {
            StripAnchors anchors;
            loadStripAnchors(model, halves.data(), model.groups[g], uint32_t(i) % strips, anchors);
            const float size = std::exp2(-10 * std::abs(random()));
            float reference[3], c0[3], c1[3];
            for (int axis = 0; axis < 3; ++axis) {
                reference[axis] = 3 * random();
                c0[axis] = reference[axis] + size * random();
                c1[axis] = i % 9 == 0 ? c0[axis] : reference[axis] + size * random();
            }
            const StripReach reach = stripReach(anchors, reference);
            const float bound = changeBound(reach, reference, c0, c1);
            const float change = stripError(anchors, 0xffff, c0, c1);
            CHECK(bound >= change);
            told += bound < 1e30f;
            near += bound < 4 * change;
        }
    }
    CHECK(told > 400 * model.params->group_count / 2);
    CHECK(near > 400 * model.params->group_count / 10);
    const float away[3] = {100, 0, 0}, here[3] = {0, 0, 0};
    CHECK(std::isinf(changeBound({1, 2, 1}, here, here, away)));
    CHECK(std::isinf(changeBound({}, here, here, here)));
}
