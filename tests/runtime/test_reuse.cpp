// SPDX-License-Identifier: Apache-2.0
// Entries that may be drawn again, and that nothing else changes: policies, budgets, both eyes.
#include <gsc/error.h>
#include "kernels/reuse/reuse_math.h"
#include "tests/runtime/reuse_tools.h"

#include <doctest/doctest.h>

#include <cmath>

using namespace gsc;
using namespace gsc::test;

namespace {

// That `options` draws over a walk what no reuse does, but for the half precision of the entries.
void checkLikeNone(const ModelView& model, const FrameOptions& options, size_t eye_count)
{
    const auto plain = open(model), reusing = open(model);
    FrameOptions none = options;
    none.reuse = {};
    for (int i = 0; i < 5; ++i) {
        CAPTURE(i);
        const auto expected = render(*plain, walk(i, eye_count), none);
        const auto actual = render(*reusing, walk(i, eye_count), options);
        for (size_t e = 0; e < eye_count; ++e) {
            CHECK(compare(actual[e].pixels, expected[e].pixels).psnr > 70);
            CHECK(double(actual[e].result.eyes[e].gaussians_visible) ==
                  doctest::Approx(double(expected[e].result.eyes[e].gaussians_visible)).epsilon(0.005));
        }
    }
}

} // namespace

TEST_CASE("a bound of 0 and a depth of 0 draw what no reuse draws")
{
    for (const LevelRule rule : {LevelRule::None, LevelRule::Round, LevelRule::Progressive})
        for (const size_t eyes : {1, 2}) {
            CAPTURE(int(rule));
            CAPTURE(eyes);
            const SyntheticModel model(modelOptions(rule));
            checkLikeNone(model.view(), with(ReusePolicy::Error), eyes);
            checkLikeNone(model.view(), with(ReusePolicy::Depth, 0, 0), eyes);
            FrameOptions soft = with(ReusePolicy::Error);
            soft.lod_fade = 0.5f;
            soft.lod_hysteresis = 0.25f;
            checkLikeNone(model.view(), soft, eyes);
        }
}

TEST_CASE("networks with every input, and float positions, draw the same from the cache")
{
    SyntheticOptions options = modelOptions(LevelRule::None);
    options.appearance_dim = 8;
    options.appearance_rows = 3;
    options.flags |= kModelFeatureBank | kModelBankDistance;
    options.inputs = kMlpTakesDistance | kMlpTakesAppearance;
    options.encoding = PositionEncoding::Float;
    options.n_offsets = 5;
    const SyntheticModel model(options);
    FrameOptions frame = with(ReusePolicy::Error);
    frame.appearance = 1;
    checkLikeNone(model.view(), frame, 2);

    // another row is another look: nothing of the first is drawn
    const auto plain = open(model.view()), reusing = open(model.view());
    frame.reuse.bound = 1000;
    (void)render(*reusing, walk(0, 1), frame);
    frame.appearance = 2;
    const auto actual = render(*reusing, walk(0, 1), frame);
    CHECK(actual[0].result.eyes[0].anchors_reused == 0);
    frame.reuse = {};
    CHECK(compare(actual[0].pixels, render(*plain, walk(0, 1), frame)[0].pixels).psnr > 70);
}

TEST_CASE("a camera that stands still decodes once")
{
    const SyntheticModel model(modelOptions(LevelRule::Round));
    const auto backend = open(model.view());
    const auto first = render(*backend, walk(3, 2), with(ReusePolicy::Error));
    for (int i = 0; i < 3; ++i) {
        const auto again = render(*backend, walk(3, 2), with(ReusePolicy::Error));
        for (size_t e = 0; e < 2; ++e) {
            const EyeCounts& counts = again[e].result.eyes[e];
            CHECK(again[e].pixels == first[e].pixels);
            CHECK(counts.anchors_decoded == 0);
            CHECK(counts.anchors_reused == counts.anchors_visible);
        }
    }
    backend->dropCaches();
    CHECK(render(*backend, walk(3, 2), with(ReusePolicy::Error))[0].result.eyes[0].anchors_reused == 0);
}

TEST_CASE("depth decodes every entry again when it is older than the depth allows")
{
    const SyntheticModel model(modelOptions(LevelRule::None));
    const auto backend = open(model.view());
    const FrameOptions options = with(ReusePolicy::Depth, 0, 3);
    for (int i = 0; i < 9; ++i) {
        CAPTURE(i);
        const auto image = render(*backend, walk(0, 1), options);
        const EyeCounts& counts = image[0].result.eyes[0];
        // all entries are of one age, so that they are due at once: the flush of the paper
        CHECK((counts.anchors_decoded > 0) == (i % 4 == 0));
        CHECK((counts.anchors_reused > 0) == (i % 4 != 0));
    }
}

TEST_CASE("the paper's loop: depth with one decode for both eyes")
{
    for (const LevelRule rule : {LevelRule::None, LevelRule::Round}) {
        CAPTURE(int(rule));
        const SyntheticModel model(modelOptions(rule));
        FrameOptions options = with(ReusePolicy::Depth, 0, 0);
        options.stereo = StereoMode::Merged;
        checkLikeNone(model.view(), options, 2);
        options.lod_fade = 0.5f;
        checkLikeNone(model.view(), options, 2);
    }
    const SyntheticModel model(modelOptions(LevelRule::None));
    checkPaperLoop(*open(model.view()), *open(model.view()), with(ReusePolicy::Depth));
}

TEST_CASE("the guidance shortens the depth as more of the view is new")
{
    for (const DepthGuidance guidance : {DepthGuidance::Linear, DepthGuidance::Exponential, DepthGuidance::Staged}) {
        CAPTURE(int(guidance));
        CHECK(reuseDepth(guidance, 10, 0) == 10);
        uint32_t before = 10;
        for (float rate = 0; rate <= 1; rate += 0.01f) {
            const uint32_t depth = reuseDepth(guidance, 10, rate);
            CHECK(depth <= before);
            before = depth;
        }
        CHECK(before == 0);
        CHECK(reuseDepth(guidance, 0, 0) == 0);
    }
    CHECK(reuseDepth(DepthGuidance::Linear, 10, 0.5f) == 5);
    CHECK(reuseDepth(DepthGuidance::Exponential, 10, 0.5f) == 1);
    CHECK(reuseDepth(DepthGuidance::Staged, 10, 0.1f) == 5);
    CHECK(reuseDepth(DepthGuidance::Staged, 10, 0.2f) == 2); // a stage ends below its border
    CHECK(reuseDepth(DepthGuidance::Staged, 10, 0.5f) == 0);
}

TEST_CASE("the depth is kept in a view that is new by a little, and falls in one that is new by half")
{
    const SyntheticModel model(modelOptions(LevelRule::None));
    const auto decodedBy = [&](float turn) { // radians per frame
        const auto backend = open(model.view());
        uint64_t decoded = 0, visible = 0;
        for (int i = 0; i < 27; ++i) {
            const float position[3] = {0, 0, 0}, angle = turn * float(i);
            const float target[3] = {std::sin(angle), 0, std::cos(angle)};
            const EyeCounts counts =
                render(*backend, {lookAt(position, target, 0.9f, 120, 90)}, with(ReusePolicy::Depth, 0, 8))[0]
                    .result.eyes[0];
            decoded += counts.anchors_decoded;
            visible += counts.anchors_visible;
        }
        return double(decoded) / double(visible);
    };
    const double still = decodedBy(0), slow = decodedBy(0.02f), fast = decodedBy(0.5f);
    CHECK(still < 0.5); // 0.33 measured, whole strips being decoded for what is seen of them; 0.30; 0.80
    CHECK(slow < 0.5);
    CHECK(fast > 1.5 * slow);
}

TEST_CASE("a decode budget holds, what is new is decoded all the same, and waiting entries count as overdue")
{
    const SyntheticModel model(modelOptions(LevelRule::None));
    const auto backend = open(model.view());
    FrameOptions options = with(ReusePolicy::Error);
    options.reuse.decode_budget = 100;
    const auto first = render(*backend, walk(0, 1), options);
    CHECK(first[0].result.eyes[0].anchors_decoded >= first[0].result.eyes[0].anchors_visible);
    for (int i = 1; i < 6; ++i) {
        // turned away from nothing: the same anchors stay in view
        std::vector<EyeParams> eye = walk(0, 1);
        eye[0].center[0] += 0.001f * float(i);
        const auto image = render(*backend, eye, options);
        const EyeCounts& counts = image[0].result.eyes[0];
        CHECK(counts.anchors_decoded <= 100);
        CHECK(counts.anchors_decoded > 100 - 16);
        CHECK(counts.anchors_overdue > 0);
        CHECK(counts.anchors_overdue <= counts.anchors_reused);
    }
}

TEST_CASE("a small cache holds its limit and draws the same")
{
    SyntheticOptions many = modelOptions(LevelRule::None);
    many.anchors = 6000;
    const SyntheticModel model(many);
    FrameOptions options = with(ReusePolicy::Error);
    options.reuse.cache_bytes = 1u << 20;
    checkLikeNone(model.view(), options, 2);
    const auto backend = open(model.view());
    uint64_t evicted = 0;
    for (int i = 0; i < 4; ++i) {
        // two views that share little, in turn
        const float center[3] = {0, 0, 0}, target[3] = {0.1f, 0.2f, i % 2 == 0 ? 9.0f : -9.0f};
        const auto image = render(*backend, {lookAt(center, target, 0.8f, 64, 64)}, options);
        evicted += image[0].result.cache_evictions;
        // the tables that find an entry are not part of the limit, they are a few bytes per strip
        CHECK(image[0].result.cache_bytes < options.reuse.cache_bytes + (1u << 18));
    }
    CHECK(evicted > 0);
    options.reuse.cache_bytes = 1; // room for nothing
    checkLikeNone(model.view(), options, 2);
}

TEST_CASE("a limit that falls is kept at once, and dropping the caches gives their memory back")
{
    SyntheticOptions many = modelOptions(LevelRule::None);
    many.anchors = 6000;
    const SyntheticModel model(many);
    const auto backend = open(model.view());
    FrameOptions options = with(ReusePolicy::Error, 4);
    const uint64_t much = render(*backend, walk(0, 1), options)[0].result.cache_bytes;
    options.reuse.cache_bytes = 1u << 20;
    const auto less = render(*backend, walk(1, 1), options);
    CHECK(less[0].result.cache_bytes < much);
    CHECK(less[0].result.cache_bytes < options.reuse.cache_bytes + (1u << 18));
    CHECK(less[0].result.cache_evictions > 0);
    options.reuse.cache_bytes = 64u << 20; // and one that rises is used
    CHECK(render(*backend, walk(1, 1), options)[0].result.cache_bytes == much);
    backend->dropCaches();
    options.reuse.cache_bytes = 1;
    const auto none = render(*backend, walk(2, 1), options);
    CHECK(none[0].result.cache_bytes < 1u << 18);
    CHECK(none[0].result.eyes[0].anchors_reused == 0);
}

TEST_CASE("an eye that draws the other's decode shows it, also where no entry holds it")
{
    const SyntheticModel model(modelOptions(LevelRule::None));
    for (const uint64_t limit : {uint64_t(0), uint64_t(1)}) {
        CAPTURE(limit);
        const auto plain = open(model.view()), reusing = open(model.view());
        FrameOptions options = with(ReusePolicy::Error, 4);
        options.reuse.cache_bytes = limit;
        for (int i = 0; i < 4; ++i) {
            const auto actual = render(*reusing, walk(i, 2, 0.001f), options);
            const auto expected = render(*plain, walk(i, 2, 0.001f), with(ReusePolicy::None));
            for (size_t e = 0; e < 2; ++e)
                CHECK(compare(actual[e].pixels, expected[e].pixels).psnr > 45);
            CHECK(actual[1].result.eyes[1].anchors_reused > 0);
        }
    }
}

// The right eye's own entry is from long ago, since it has drawn the left one's ever since.
TEST_CASE("an eye that would share what the budget does not let the other decode draws the better of both entries")
{
    const SyntheticModel model(modelOptions(LevelRule::None));
    const auto plain = open(model.view()), reusing = open(model.view());
    FrameOptions options = with(ReusePolicy::Error, 4);
    (void)render(*reusing, {walk(-160, 1)[0], walk(-110, 1)[0]}, options); // so far apart that both decode
    for (int i = 0; i < 8; ++i)
        (void)render(*reusing, walk(i % 2, 2, 0.001f), options);
    options.reuse.bound = 0.3f;
    options.reuse.decode_budget = 1;
    const auto actual = render(*reusing, walk(2, 2, 0.001f), options);
    const auto expected = render(*plain, walk(2, 2, 0.001f), with(ReusePolicy::None));
    for (size_t e = 0; e < 2; ++e) {
        CAPTURE(e);
        CHECK(actual[e].result.eyes[e].anchors_overdue > 100);
        const Difference d = compare(actual[e].pixels, expected[e].pixels);
        CHECK(d.psnr > 60);       // 66 measured, 38 for the right eye if it has only its own
        CHECK(d.worst * 255 < 6); // 3.7, and 54
    }
}

TEST_CASE("black and background are told apart as without reuse")
{
    size_t black = 0, grey = 0;
    for (uint32_t seed = 1; seed <= 60; ++seed) {
        SyntheticOptions options;
        options.anchors = 3;
        options.n_offsets = 1;
        options.seed = seed;
        const SyntheticModel model(options);
        const auto plain = open(model.view(), 1), reusing = open(model.view(), 1);
        FrameOptions none = with(ReusePolicy::None);
        const auto expected = render(*plain, walk(0, 1), none);
        const auto actual = render(*reusing, walk(0, 1), with(ReusePolicy::Error));
        CAPTURE(seed);
        CHECK(compare(actual[0].pixels, expected[0].pixels).psnr > 60);
        black += expected[0].pixels[0] == 0;
        grey += expected[0].pixels[0] == 0.5f;
    }
    CHECK(black > 0);
    CHECK(grey > 0);
}

TEST_CASE("eyes come and go, policies change, and both eyes stay within what the options say")
{
    const SyntheticModel model(modelOptions(LevelRule::None));
    const auto plain = open(model.view()), reusing = open(model.view());
    for (int i = 0; i < 40; ++i) {
        CAPTURE(i);
        const size_t eyes = size_t(i / 5) % 2 + 1;
        const ReusePolicy policy = i % 7 == 3   ? ReusePolicy::None
                                   : i % 11 > 7 ? ReusePolicy::Depth
                                                : ReusePolicy::Error;
        FrameOptions options = with(policy, 2, 1);
        options.reuse.decode_budget = i % 3 == 0 ? 400 : 0;
        const auto actual = render(*reusing, walk(i, eyes), options);
        const auto expected = render(*plain, walk(i, eyes), with(ReusePolicy::None));
        for (size_t e = 0; e < eyes; ++e)
            CHECK(compare(actual[e].pixels, expected[e].pixels).psnr > 40);
    }
}

TEST_CASE("images do not depend on the number of threads, whatever is kept")
{
    const SyntheticModel model(modelOptions(LevelRule::Round));
    FrameOptions options = with(ReusePolicy::Error, 1);
    options.reuse.decode_budget = 300;
    options.reuse.cache_bytes = 4u << 20;
    const auto one = open(model.view(), 1), many = open(model.view(), 5);
    for (int i = 0; i < 8; ++i) {
        const auto a = render(*one, walk(2 * i, 2), options), b = render(*many, walk(2 * i, 2), options);
        CHECK(a[0].pixels == b[0].pixels);
        CHECK(a[1].pixels == b[1].pixels);
        CHECK(a[1].result.eyes[1].anchors_decoded == b[1].result.eyes[1].anchors_decoded);
    }
}

TEST_CASE("an eye draws what the other had decoded if the bound allows it")
{
    const SyntheticModel model(modelOptions(LevelRule::None));
    const auto backend = open(model.view());
    const auto near = render(*backend, walk(0, 2, 0.0001f), with(ReusePolicy::Error, 4));
    const EyeCounts &left = near[0].result.eyes[0], &right = near[1].result.eyes[1];
    CHECK(left.anchors_reused == 0);
    CHECK(right.anchors_reused + 64 > right.anchors_visible); // all but what the left eye does not see
    backend->dropCaches();
    const auto apart = render(*backend, walk(0, 2, 2.0f), with(ReusePolicy::Error, 0.01f));
    CHECK(apart[1].result.eyes[1].anchors_reused == 0);
}

TEST_CASE("what cannot be kept is refused")
{
    const SyntheticModel model(modelOptions(LevelRule::None));
    const auto reference = makeCpuRenderer(CpuPath::Reference, 1);
    reference->load(model.view());
    const std::vector<EyeParams> eyes = walk(0, 1);
    CHECK_THROWS_AS(render(*reference, eyes, with(ReusePolicy::Error)), Error);
    const auto fast = open(model.view());
    for (const float bound : {-1.0f, 2e6f, std::numeric_limits<float>::quiet_NaN()})
        CHECK_THROWS_AS(render(*fast, eyes, with(ReusePolicy::Error, bound)), Error);
}
