// SPDX-License-Identifier: Apache-2.0
// Reuse on a GPU: what is drawn again is what was decoded, whatever model, eyes and frames there are.
#include <gsc/error.h>
#include "tests/kernels/reuse_tools.h"

#include <doctest/doctest.h>

#include <algorithm>

using namespace gsc;
using namespace gsc::test;

namespace {

// Frame `i` of a walk with eyes that look the same way, and so share their bins.
std::vector<EyeParams> walkAhead(int i, float apart)
{
    const float x = 0.2f + 0.02f * float(i), z = -5 + 0.01f * float(i);
    return {eyeAhead(x, z, 120, 90), eyeAhead(x + apart, z, 120, 90)};
}

} // namespace

TEST_CASE("reuse: a depth of 0 draws what no reuse draws")
{
    for (const LevelRule rule : {LevelRule::None, LevelRule::Round})
        for (const size_t eyes : {1, 2}) {
            CAPTURE(int(rule));
            CAPTURE(eyes);
            const SyntheticModel model(modelOptions(rule));
            checkLikeNone(model.view(), with(ReusePolicy::Depth, 0), eyes);
        }
}

TEST_CASE("reuse: eyes that share their bins, with entries of their own or one for both, or none at all")
{
    const SyntheticModel model(modelOptions(LevelRule::Round));
    const auto plain = open(model.view());
    for (const StereoMode stereo : {StereoMode::Exact, StereoMode::Merged})
        for (const uint64_t limit : {uint64_t(0), uint64_t(150) << 10, uint64_t(1)})
            for (const float apart : {0.001f, 1.5f}) {
                CAPTURE(int(stereo));
                CAPTURE(limit);
                CAPTURE(apart);
                const auto reusing = open(model.view());
                FrameOptions options = with(ReusePolicy::Depth, 0), none = with(ReusePolicy::None);
                options.stereo = none.stereo = stereo;
                options.reuse.cache_bytes = limit;
                for (int i = 0; i < 3; ++i) {
                    CAPTURE(i);
                    const auto expected = render(*plain, walkAhead(i, apart), none);
                    const auto actual = render(*reusing, walkAhead(i, apart), options);
                    CHECK(actual[0].result.eyes[1].pairs == 0); // they do share
                    for (size_t e = 0; e < 2; ++e) {
                        const EyeCounts& counts = actual[e].result.eyes[e];
                        CHECK(compare(actual[e].pixels, expected[e].pixels).psnr >= 75);
                        CHECK(counts.anchors_decoded <= 1200); // each strip once
                        CHECK(counts.anchors_decoded + counts.anchors_reused >= counts.anchors_visible);
                    }
                    const double pairs = double(expected[0].result.eyes[0].pairs);
                    const bool together = limit == 0 || stereo == StereoMode::Merged; // what is decoded for both
                    CHECK(double(actual[0].result.eyes[0].pairs) < pairs * (together ? 1.01 : 2));
                }
            }
}

TEST_CASE("reuse: networks with every input, levels that fade, and few Gaussians per anchor")
{
    SyntheticOptions options = modelOptions(LevelRule::Progressive);
    options.appearance_dim = 8;
    options.appearance_rows = 3;
    options.flags |= kModelFeatureBank | kModelBankDistance | kModelBankLevel;
    options.inputs = kMlpTakesDistance | kMlpTakesAppearance | kMlpTakesLevel;
    options.n_offsets = 5;
    const SyntheticModel model(options);
    FrameOptions frame = with(ReusePolicy::Depth, 0);
    frame.appearance = 1;
    frame.lod_fade = 0.5f;
    checkLikeNone(model.view(), frame, 2);

    // another row is another look: nothing of the first is drawn
    const auto plain = open(model.view()), reusing = open(model.view());
    frame.reuse.max_depth = 1000;
    (void)render(*reusing, walk(0, 1), frame);
    frame.appearance = 2;
    const auto actual = render(*reusing, walk(0, 1), frame);
    CHECK(actual[0].result.eyes[0].anchors_reused == 0);
    frame.reuse = {};
    CHECK(compare(actual[0].pixels, render(*plain, walk(0, 1), frame)[0].pixels).psnr >= 75);
}

TEST_CASE("reuse: black and background are told apart as without it")
{
    size_t black = 0, grey = 0;
    for (uint32_t seed = 1; seed <= 40; ++seed) {
        CAPTURE(seed);
        SyntheticOptions options;
        options.anchors = 3;
        options.n_offsets = 1;
        options.seed = seed;
        const SyntheticModel model(options);
        const auto plain = open(model.view()), reusing = open(model.view());
        const auto expected = render(*plain, walk(0, 1), with(ReusePolicy::None));
        FrameOptions kept = with(ReusePolicy::Depth);
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

TEST_CASE("reuse: eyes come and go, reuse too, and both eyes stay close to what is decoded for every frame")
{
    const SyntheticModel model(modelOptions());
    const auto plain = open(model.view()), reusing = open(model.view());
    uint64_t reused = 0;
    for (int i = 0; i < 16; ++i) {
        CAPTURE(i);
        const size_t eyes = size_t(i / 5) % 2 + 1;
        FrameOptions options = with(i % 7 == 3 ? ReusePolicy::None : ReusePolicy::Depth, 1);
        if (i % 11 > 7)
            options.stereo = StereoMode::Merged;
        const auto actual = render(*reusing, walk(i, eyes), options);
        FrameOptions none = options;
        none.reuse = {};
        const auto expected = render(*plain, walk(i, eyes), none);
        for (size_t e = 0; e < eyes; ++e) {
            CHECK(compare(actual[e].pixels, expected[e].pixels).psnr > 40);
            reused += actual[e].result.eyes[e].anchors_reused;
        }
    }
    CHECK(reused > 0);
}

TEST_CASE("reuse: frames of several passes keep nothing and draw the same")
{
    SyntheticOptions many = modelOptions();
    many.anchors = 6000 * kManyAnchors;
    many.log_scale = -3.5f;
    const SyntheticModel model(many);
    const std::vector<EyeParams> eyes = {eyeAt(0.4f, -5, 150, 110), eyeAt(0.7f, -5, 97, 120)};
    const auto plain = open(model.view());
    const auto want = render(*plain, eyes, with(ReusePolicy::None));
    FrameOptions options = with(ReusePolicy::Depth);
    options.reuse.cache_bytes = 64 << 10;
    const auto roomy = open(model.view());
    const uint64_t context = roomy->device().context_bytes; // which no budget makes smaller
    uint64_t part = render(*roomy, eyes, options)[0].result.bytes_resident - context;
    uint32_t most = 1;
    try {
        for (; most == 1; part = part * 15 / 16) {
            const uint64_t budget = context + part;
            const std::unique_ptr<Renderer> gpu = makeRenderer({"cuda"}, {0, budget});
            gpu->load(model.view());
            for (int i = 0; i < 2; ++i) {
                const auto got = render(*gpu, eyes, options);
                CHECK(got[0].result.bytes_resident <= budget);
                const uint32_t passes = got[0].result.passes;
                for (size_t e = 0; e < 2; ++e) {
                    CHECK(compare(got[e].pixels, want[e].pixels).psnr >= (passes > 1 ? 200 : 65));
                    if (passes > 1)
                        CHECK(got[e].result.eyes[e].anchors_decoded == got[e].result.eyes[e].anchors_visible);
                }
                most = std::max(most, passes);
            }
        }
    } catch (const Error& error) {
        CHECK(error.code() == ErrorCode::OutOfMemory);
    }
    CHECK(most > 1);
}
