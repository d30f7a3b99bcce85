// SPDX-License-Identifier: Apache-2.0
// Reuse on a GPU: the policies decide as on a CPU, and by error within its bound.
#include "kernels/reuse/policy.h"
#include "tests/kernels/reuse_tools.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

using namespace gsc;
using namespace gsc::test;

TEST_CASE("reuse: the paper's loop, depth with one decode for both eyes")
{
    for (const LevelRule rule : {LevelRule::None, LevelRule::Round}) {
        CAPTURE(int(rule));
        const SyntheticModel model(modelOptions(rule));
        FrameOptions options = with(ReusePolicy::Depth, 0, 0);
        options.stereo = StereoMode::Merged;
        checkLikeNone(model.view(), options, 2);
        options.reuse.cache_bytes = uint64_t(60) << 10; // most strips have no entry
        checkLikeNone(model.view(), options, 2);
    }
    const SyntheticModel model(modelOptions(LevelRule::None));
    checkPaperLoop(*open(model.view()), *open(model.view()), with(ReusePolicy::Depth));
}

TEST_CASE("reuse: a strip is decoded again when its predicted change is above the bound, and not before")
{
    const StepScene scene;
    const auto backend = makeRenderer({"cuda"}, {1});
    const float needed = scene.change() / kAnew.erratic;             // the camera stood still before
    CHECK(scene.decoded(*backend, 0.98f * needed) >= kStripAnchors); // two keys count twice
    CHECK(scene.decoded(*backend, 1.02f * needed) == 0);
}

TEST_CASE("reuse: a camera that stands still decodes once")
{
    for (const size_t eyes : {1, 2}) {
        CAPTURE(eyes);
        const SyntheticModel model(modelOptions(LevelRule::Round));
        const auto backend = open(model.view()), plain = open(model.view());
        const auto expected = render(*plain, walk(3, eyes), with(ReusePolicy::None));
        const auto first = render(*backend, walk(3, eyes), with(ReusePolicy::Error, 1));
        for (size_t e = 0; e < eyes; ++e) {
            const EyeCounts& counts = first[e].result.eyes[e];
            CHECK(compare(first[e].pixels, expected[e].pixels).psnr >= 75);
            CHECK(counts.anchors_decoded + counts.anchors_reused >= counts.anchors_visible);
        }
        CHECK(first[0].result.eyes[0].anchors_reused == 0);
        CHECK(first[0].result.cache_bytes > 0);
        for (int i = 0; i < 3; ++i) {
            const auto again = render(*backend, walk(3, eyes), with(ReusePolicy::Error, 1));
            for (size_t e = 0; e < eyes; ++e) {
                const EyeCounts& counts = again[e].result.eyes[e];
                CHECK(compare(again[e].pixels, expected[e].pixels).psnr >= 75);
                CHECK(counts.anchors_decoded == 0);
                CHECK(counts.anchors_reused == counts.anchors_visible);
                CHECK(counts.gaussians_alive > 0);
            }
        }
        backend->dropCaches();
        CHECK(render(*backend, walk(3, eyes), with(ReusePolicy::Error, 1))[0].result.eyes[0].anchors_reused == 0);
        CHECK(render(*backend, walk(3, eyes), with(ReusePolicy::Depth))[0].result.eyes[0].anchors_reused == 0);
    }
}

TEST_CASE("reuse: depth decides as on a CPU")
{
    for (const DepthGuidance guidance : {DepthGuidance::Linear, DepthGuidance::Staged}) {
        CAPTURE(int(guidance));
        const SyntheticModel model(modelOptions(LevelRule::Round));
        const auto gpu = open(model.view()), cpu = open(model.view(), "cpu");
        FrameOptions options = with(ReusePolicy::Depth, 0, 3);
        options.reuse.guidance = guidance;
        uint64_t reused = 0;
        for (int i = 0; i < 7; ++i) {
            CAPTURE(i);
            const std::vector<EyeParams> eyes = walk(i < 5 ? i : 6 * i, guidance == DepthGuidance::Linear ? 2 : 1);
            const auto a = render(*gpu, eyes, options), b = render(*cpu, eyes, options);
            for (size_t e = 0; e < eyes.size(); ++e) {
                const EyeCounts &got = a[e].result.eyes[e], &want = b[e].result.eyes[e];
                CHECK(got.anchors_decoded == want.anchors_decoded);
                CHECK(got.anchors_reused == want.anchors_reused);
                reused += got.anchors_reused;
            }
        }
        CHECK(reused > 0);
    }
}

// Of a camera that goes another way in every frame both keep single keys, from its own place; of small Gaussians neither
// knows a cover. What is left of the tuning is the share of the bound.
TEST_CASE("reuse: the error policy decides as on a CPU, for one eye and for two, with a budget and without")
{
    SyntheticOptions small = modelOptions(LevelRule::Round);
    small.log_scale = -8;
    const SyntheticModel model(small);
    for (const size_t eye_count : {1, 2})
        for (const uint64_t budget : {0, 150}) {
            CAPTURE(eye_count);
            CAPTURE(budget);
            const auto gpu = open(model.view()), cpu = open(model.view(), "cpu");
            FrameOptions on_gpu = with(ReusePolicy::Error, 2 / kAnew.erratic);
            FrameOptions on_cpu = with(ReusePolicy::Error, 2 / kGoesOn.erratic);
            on_gpu.reuse.decode_budget = on_cpu.reuse.decode_budget = budget;
            uint64_t decoded = 0, reused = 0, overdue = 0;
            for (int i = 0; i < 14; ++i) {
                CAPTURE(i);
                const int at = i < 2 ? 0 : i * (i % 2 == 0 ? 1 : -1); // ever farther to and fro
                const std::vector<EyeParams> eyes = walk(at, eye_count, 0.02f);
                const auto a = render(*gpu, eyes, on_gpu), b = render(*cpu, eyes, on_cpu);
                for (size_t e = 0; e < eye_count; ++e) {
                    const EyeCounts &got = a[e].result.eyes[e], &want = b[e].result.eyes[e];
                    CHECK(got.anchors_decoded == want.anchors_decoded);
                    CHECK(got.anchors_reused == want.anchors_reused);
                    CHECK(got.anchors_overdue == want.anchors_overdue);
                    decoded += i > 0 ? got.anchors_decoded : 0;
                    reused += got.anchors_reused;
                    overdue += got.anchors_overdue;
                }
            }
            CHECK(decoded > 0);
            CHECK(reused > 0);
            CHECK((overdue > 0) == (budget > 0));
        }
}

TEST_CASE("reuse: the error policy decodes less the larger its bound and stays close to the truth")
{
    const SyntheticModel model(modelOptions());
    uint64_t before = UINT64_MAX;
    for (const float bound : {0.0f, 1.0f, 8.0f}) {
        CAPTURE(bound);
        const auto plain = open(model.view()), reusing = open(model.view());
        uint64_t decoded = 0;
        double worst = 1000;
        for (int i = 0; i < 8; ++i) {
            const auto actual = render(*reusing, walk(i, 1), with(ReusePolicy::Error, bound));
            const auto expected = render(*plain, walk(i, 1), with(ReusePolicy::None));
            decoded += actual[0].result.eyes[0].anchors_decoded;
            worst = std::min(worst, compare(actual[0].pixels, expected[0].pixels).psnr);
        }
        CHECK(decoded < before);
        CHECK(worst >= (bound > 1 ? 55 : 70)); // 62 and 79 measured
        before = decoded;
    }
}

// What passes beside the camera changes fast and is not seen: it has nothing decoded again. Once the camera turns to it,
// it is held to the bound like all else.
TEST_CASE("reuse: anchors that are not seen make nothing due, and are drawn within the bound when they come into view")
{
    SyntheticOptions of = modelOptions();
    of.anchors = 3000;
    const SyntheticModel model(of);
    const auto plain = open(model.view()), reusing = open(model.view());
    uint64_t decoded = 0, visible = 0;
    for (int i = 0; i < 24; ++i) {
        CAPTURE(i);
        const float position[3] = {0.1f, 0.2f, -2 + 0.03f * float(i)};
        const float turn = i > 20 ? 1.5f : 0.0f;
        const float target[3] = {0.1f + std::sin(turn), 0.2f, position[2] + std::cos(turn)};
        const std::vector<EyeParams> eye = {lookAt(position, target, 0.9f, 120, 90)};
        const auto actual = render(*reusing, eye, with(ReusePolicy::Error, 4));
        const auto expected = render(*plain, eye, with(ReusePolicy::None));
        const double psnr = compare(actual[0].pixels, expected[0].pixels).psnr;
        // 66 and 61 measured, 58 after the turn if widen() did nothing
        CHECK(psnr > (i > 20 ? 62 : 56));
        const EyeCounts& counts = actual[0].result.eyes[0];
        if (i >= 4 && i <= 20) {
            decoded += counts.anchors_decoded;
            visible += counts.anchors_visible;
        }
    }
    const double share = double(decoded) / double(visible);
    CHECK(share < 0.165); // 0.150 measured, 0.182 if all of a strip counted
}

TEST_CASE("reuse: an eye draws what the other had decoded if the bound allows it")
{
    const SyntheticModel model(modelOptions());
    const auto plain = open(model.view());
    for (const uint64_t limit : {uint64_t(0), uint64_t(1)}) {
        CAPTURE(limit);
        const auto backend = open(model.view());
        FrameOptions options = with(ReusePolicy::Error, 4);
        options.reuse.cache_bytes = limit;
        const auto near = render(*backend, walk(0, 2, 0.0001f), options);
        CHECK(near[0].result.eyes[0].anchors_reused == 0);
        const EyeCounts& right = near[1].result.eyes[1];
        if (limit == 0)
            CHECK(right.anchors_reused + 64 > right.anchors_visible); // all but what the left eye does not see
        else // no slot holds it: each eye has its own decode, and counts it
            CHECK(right.anchors_decoded >= right.anchors_visible);
        const auto expected = render(*plain, walk(0, 2, 0.0001f), with(ReusePolicy::None));
        for (size_t e = 0; e < 2; ++e)
            CHECK(compare(near[e].pixels, expected[e].pixels).psnr >= 60);
        const auto apart = render(*backend, walk(0, 2, 2.0f), with(ReusePolicy::Error, 0.01f));
        CHECK(apart[1].result.eyes[1].anchors_reused == 0);
    }
}

// Where the camera goes to and fro an error changes its sign, and flickers by twice itself.
TEST_CASE("reuse: a camera that goes to and fro is held to half the bound")
{
    const SyntheticModel model(modelOptions());
    const auto plain = open(model.view()), reusing = open(model.view());
    double worst = 1000;
    uint64_t decoded = 0, visible = 0;
    for (int i = 0; i < 16; ++i) {
        CAPTURE(i);
        const std::vector<EyeParams> eye = walk(i * 7 % 5, 1);
        const auto actual = render(*reusing, eye, with(ReusePolicy::Error, 2));
        const auto expected = render(*plain, eye, with(ReusePolicy::None));
        worst = std::min(worst, compare(actual[0].pixels, expected[0].pixels).psnr);
        if (i > 0) {
            decoded += actual[0].result.eyes[0].anchors_decoded;
            visible += actual[0].result.eyes[0].anchors_visible;
        }
    }
    CHECK(worst > 75);                                // 80 measured
    CHECK(double(decoded) > 0.205 * double(visible)); // 0.225 measured, 0.186 by the whole bound
}

// The right eye comes to where the left one was, whose entries this frame replaces.
TEST_CASE("reuse: an eye does not draw the other's entry in the frame that replaces it")
{
    const SyntheticModel model(modelOptions());
    const auto plain = open(model.view()), reusing = open(model.view());
    for (const float x : {0.5f, 0.0f}) {
        const std::vector<EyeParams> eyes = strafe(x, 2, 0.5f);
        const auto actual = render(*reusing, eyes, with(ReusePolicy::Error, 0.5f));
        const auto expected = render(*plain, eyes, with(ReusePolicy::None));
        for (size_t e = 0; e < 2; ++e) // 87 measured, 48 for the right eye if it does
            CHECK(compare(actual[e].pixels, expected[e].pixels).psnr > 75);
    }
}

// On along the line through two keys an entry gets worse though the camera is on it.
TEST_CASE("reuse: entries are decoded again before the camera is far beyond their second key")
{
    const SyntheticModel model(modelOptions());
    const auto plain = open(model.view()), reusing = open(model.view());
    uint64_t decoded = 0, visible = 0;
    double worst = 1000;
    for (int i = 0; i < 16; ++i) {
        const std::vector<EyeParams> eye = strafe(-0.4f + 0.05f * float(i), 1);
        const auto actual = render(*reusing, eye, with(ReusePolicy::Error, 2));
        const auto expected = render(*plain, eye, with(ReusePolicy::None));
        worst = std::min(worst, compare(actual[0].pixels, expected[0].pixels).psnr);
        decoded += i > 1 ? actual[0].result.eyes[0].anchors_decoded : 0;
        visible += i > 1 ? actual[0].result.eyes[0].anchors_visible : 0;
    }
    CHECK(worst > 75.5); // 77.3 measured; 74.0 and a share of 0.093 if a look at an entry took its line for straight
    CHECK(double(decoded) > 0.1 * double(visible)); // 0.106 measured
}

TEST_CASE("reuse: a budget that is too small for the bound makes entries live longer, for less error")
{
    const SyntheticModel model(modelOptions());
    const auto plain = open(model.view()), reusing = open(model.view());
    FrameOptions options = with(ReusePolicy::Error, 0.1f);
    options.reuse.decode_budget = 200;
    double worst = 1000;
    for (int i = 0; i < 20; ++i) {
        const std::vector<EyeParams> eye = strafe(-0.2f + 0.02f * float(i), 1);
        const auto actual = render(*reusing, eye, options);
        const auto expected = render(*plain, eye, with(ReusePolicy::None));
        CHECK(actual[0].result.eyes[0].anchors_decoded <= (i == 0 ? 1200 : 400)); // what is new comes on top
        if (i >= 8)
            worst = std::min(worst, compare(actual[0].pixels, expected[0].pixels).psnr);
    }
    CHECK(worst > 67); // 69.2 measured, 64.3 if they lived as long as the bound says
}

TEST_CASE("reuse: another policy draws nothing of what one kept")
{
    const SyntheticModel model(modelOptions());
    const auto first = open(model.view()), second = open(model.view());
    const auto turned = [](float by) {
        const float position[3] = {0.1f, 0.2f, -2}, target[3] = {0.1f + std::sin(by), 0.2f, -2 + std::cos(by)};
        return std::vector<EyeParams>{lookAt(position, target, 0.9f, 80, 60)};
    };
    (void)render(*first, turned(0), with(ReusePolicy::Error, 1));
    for (const float by : {0.6f, 0.5f}) { // which brings back some of the first view
        CAPTURE(by);
        const EyeCounts a = render(*first, turned(by), with(ReusePolicy::Depth))[0].result.eyes[0];
        const EyeCounts b = render(*second, turned(by), with(ReusePolicy::Depth))[0].result.eyes[0];
        CHECK(a.anchors_decoded == b.anchors_decoded);
        CHECK(a.anchors_reused == b.anchors_reused);
        CHECK((b.anchors_reused > 0) == (by < 0.6f));
    }
}
