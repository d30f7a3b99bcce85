// SPDX-License-Identifier: Apache-2.0
// Reuse: what is drawn again is what was decoded, whatever backend, policy, model, eyes and frames there are.
#include "tests/backends/reuse_scene.h"

#include <doctest/doctest.h>

using namespace gsc;
using namespace gsc::test;

TEST_CASE("reuse: a bound of 0 and a depth of 0 draw what no reuse draws")
{
    for (const LevelRule rule : {LevelRule::None, LevelRule::Round, LevelRule::Progressive})
        for (const size_t eyes : {1, 2})
            for (const ReusePolicy policy : kBackend.policies) {
                CAPTURE(int(rule));
                CAPTURE(eyes);
                CAPTURE(int(policy));
                const SyntheticModel model(modelOptions(rule));
                checkLikeNone(model.view(), with(policy, 0, 0), eyes);
            }
}

TEST_CASE("reuse: networks with every input, float positions, levels that fade, and few Gaussians per anchor")
{
    SyntheticOptions options = modelOptions(LevelRule::Progressive);
    options.appearance_dim = 8;
    options.appearance_rows = 3;
    options.flags |= kModelFeatureBank | kModelBankDistance | kModelBankLevel;
    options.inputs = kMlpTakesDistance | kMlpTakesAppearance | kMlpTakesLevel;
    options.encoding = PositionEncoding::Float;
    options.n_offsets = 5;
    const SyntheticModel model(options);
    for (const ReusePolicy policy : kBackend.policies) {
        CAPTURE(int(policy));
        FrameOptions frame = with(policy, 0, 0);
        frame.appearance = 1;
        frame.lod_fade = 0.5f;
        checkLikeNone(model.view(), frame, 2);

        // another row is another look: nothing of the first is drawn
        const auto plain = open(model.view()), reusing = open(model.view());
        frame.reuse.bound = 1000;
        frame.reuse.max_depth = 1000;
        (void)render(*reusing, walk(0, 1), frame);
        frame.appearance = 2;
        const auto actual = render(*reusing, walk(0, 1), frame);
        CHECK(actual[0].result.eyes[0].anchors_reused == 0);
        frame.reuse = {};
        CHECK(compare(actual[0].pixels, render(*plain, walk(0, 1), frame)[0].pixels).psnr >= kBackend.kept_db);
    }
}

TEST_CASE("reuse: a camera that stands still decodes once")
{
    const SyntheticModel model(modelOptions(LevelRule::Round));
    for (const size_t eyes : {1, 2})
        for (const ReusePolicy policy : kBackend.policies) {
            CAPTURE(eyes);
            CAPTURE(int(policy));
            const auto backend = open(model.view()), plain = open(model.view());
            const auto expected = render(*plain, walk(3, eyes), with(ReusePolicy::None));
            const auto first = render(*backend, walk(3, eyes), with(policy));
            for (size_t e = 0; e < eyes; ++e) {
                const EyeCounts& counts = first[e].result.eyes[e];
                CHECK(compare(first[e].pixels, expected[e].pixels).psnr >= kBackend.kept_db);
                CHECK(counts.anchors_decoded >= counts.anchors_visible);
                CHECK(counts.anchors_reused == 0);
            }
            CHECK(first[0].result.cache_bytes > 0);
            for (int i = 0; i < 3; ++i) {
                const auto again = render(*backend, walk(3, eyes), with(policy));
                for (size_t e = 0; e < eyes; ++e) {
                    const EyeCounts& counts = again[e].result.eyes[e];
                    CHECK(sameBytes(again[e].pixels, first[e].pixels));
                    CHECK(counts.anchors_decoded == 0);
                    CHECK(counts.anchors_reused == counts.anchors_visible);
                    CHECK(counts.gaussians_alive > 0);
                }
            }
            backend->dropCaches();
            CHECK(render(*backend, walk(3, eyes), with(policy))[0].result.eyes[0].anchors_reused == 0);
        }
}

TEST_CASE("reuse: the paper's loop, depth with one decode for both eyes")
{
    FrameOptions merged = mergedEyes(with(ReusePolicy::Depth, 0, 0));
    for (const LevelRule rule : {LevelRule::None, LevelRule::Round}) {
        CAPTURE(int(rule));
        const SyntheticModel model(modelOptions(rule));
        FrameOptions options = merged;
        checkLikeNone(model.view(), options, 2);
        options.lod_fade = 0.5f;
        options.reuse.cache_bytes = uint64_t(30) << 10; // most strips have no entry
        checkLikeNone(model.view(), options, 2);
    }
    // before a camera that stands still every entry is decoded again after three frames, once for both eyes
    const SyntheticModel model(modelOptions(LevelRule::None));
    const auto together = open(model.view()), apart = open(model.view());
    const FrameOptions each = with(ReusePolicy::Depth, 0, 3);
    merged.reuse = each.reuse;
    const auto decodedBy = [](const std::vector<Image<float>>& images) {
        const EyeCounts* const eyes = images[0].result.eyes;
        return eyes[0].anchors_decoded + eyes[1].anchors_decoded;
    };
    for (int i = 0; i < 9; ++i) {
        CAPTURE(i);
        const auto one = render(*together, walk(0, 2), merged), two = render(*apart, walk(0, 2), each);
        CHECK((decodedBy(one) > 0) == (i % 4 == 0)); // all entries are of one age
        CHECK(double(decodedBy(one)) <= 0.6 * double(decodedBy(two)));
        for (size_t e = 0; e < 2; ++e)
            CHECK(compare(one[e].pixels, two[e].pixels).psnr > 25);
    }
    // what was decoded for both is not what an eye of its own keeps
    CHECK(decodedBy(render(*together, walk(0, 2), each)) > 0);
}

TEST_CASE("reuse: black and background are told apart as without it")
{
    size_t black = 0, grey = 0;
    for (uint32_t seed = 1; seed <= 60; ++seed) {
        CAPTURE(seed);
        const SyntheticModel model({.anchors = 3, .n_offsets = 1, .seed = seed});
        const auto plain = open(model.view(), 1), reusing = open(model.view(), 1);
        const auto expected = render(*plain, walk(0, 1), with(ReusePolicy::None));
        FrameOptions kept = with(kBackend.policies[0]);
        for (const uint64_t limit : {0, 0, 1}) { // as it is decoded into an entry, as it is kept, and without an entry
            kept.reuse.cache_bytes = limit;
            CHECK(compare(render(*reusing, walk(0, 1), kept)[0].pixels, expected[0].pixels).psnr >= 60);
        }
        black += expected[0].pixels[0] == 0;
        grey += expected[0].pixels[0] == 0.5f;
    }
    CHECK(black > 0);
    CHECK(grey > 0);
}

TEST_CASE("reuse: eyes come and go, policies change, and both eyes stay close to what is decoded for every frame")
{
    const SyntheticModel model(modelOptions());
    const auto plain = open(model.view()), reusing = open(model.view());
    uint64_t reused = 0;
    for (int i = 0; i < 8 * kBackend.frames; ++i) {
        CAPTURE(i);
        const size_t eyes = size_t(i / 5) % 2 + 1;
        FrameOptions options = with(kBackend.policies[0], 2, 1);
        options.reuse.decode_budget = i % 3 == 0 ? 400 : 0;
        if (i % 7 == 3)
            options.reuse = {};
        else if (i % 11 > 7)
            options.reuse.policy = ReusePolicy::Depth;
        options.stereo = i % 11 > 7 && i % 2 == 0 ? StereoMode::Merged : StereoMode::Exact;
        const auto actual = render(*reusing, walk(i, eyes), options);
        options.reuse = {};
        const auto expected = render(*plain, walk(i, eyes), options);
        for (size_t e = 0; e < eyes; ++e) {
            CHECK(compare(actual[e].pixels, expected[e].pixels).psnr > 40);
            reused += actual[e].result.eyes[e].anchors_reused;
        }
    }
    CHECK(reused > 0);
}

TEST_CASE("reuse: a small cache holds its limit, gives up what was drawn least recently, and draws the same")
{
    const SyntheticModel model(modelOptions());
    const float center[3] = {0, 0, 0};
    const auto look = [&](float z) {
        const float target[3] = {0.1f, 0.2f, z};
        return std::vector<EyeParams>{lookAt(center, target, 0.8f, 64, 64)};
    };
    for (const ReusePolicy policy : kBackend.policies) {
        CAPTURE(int(policy));
        FrameOptions options = with(policy);
        options.reuse.cache_bytes = 60u << 10;
        const auto backend = open(model.view()), plain = open(model.view());
        uint64_t evicted = 0;
        for (int i = 0; i < 6; ++i) {
            const std::vector<EyeParams> eyes = look(i % 2 == 0 ? 9.0f : -9.0f); // two views that share little
            const auto image = render(*backend, eyes, options);
            evicted += image[0].result.cache_evictions;
            CHECK(compare(image[0].pixels, render(*plain, eyes, with(ReusePolicy::None))[0].pixels).psnr >=
                  kBackend.kept_db);
            CHECK(image[0].result.cache_bytes < options.reuse.cache_bytes + kBackend.table_bytes);
        }
        CHECK(evicted > 0);
        // what stays in view stays kept
        const auto twice = render(*backend, look(-9.0f), options);
        CHECK(twice[0].result.eyes[0].anchors_reused > twice[0].result.eyes[0].anchors_visible / 2);

        options.reuse.max_depth = 0;
        for (const uint64_t room : {1, 20 << 10}) { // for nothing, for some strips
            options.reuse.cache_bytes = room;
            checkLikeNone(model.view(), options, 2);
        }
    }
}
