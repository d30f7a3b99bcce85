// SPDX-License-Identifier: Apache-2.0
// Reuse on a GPU: it decides as on a CPU, and says what it does not do.
#include <gsc/error.h>
#include "tests/kernels/reuse_tools.h"

#include <doctest/doctest.h>

using namespace gsc;
using namespace gsc::test;

TEST_CASE("reuse: the paper's loop, depth with one decode for both eyes")
{
    for (const LevelRule rule : {LevelRule::None, LevelRule::Round}) {
        CAPTURE(int(rule));
        const SyntheticModel model(modelOptions(rule));
        FrameOptions options = with(ReusePolicy::Depth, 0);
        options.stereo = StereoMode::Merged;
        checkLikeNone(model.view(), options, 2);
        options.reuse.cache_bytes = uint64_t(30) << 10; // most strips have no entry
        checkLikeNone(model.view(), options, 2);
    }
    const SyntheticModel model(modelOptions(LevelRule::None));
    checkPaperLoop(*open(model.view()), *open(model.view()), with(ReusePolicy::Depth));
}

TEST_CASE("reuse: a camera that stands still decodes once")
{
    for (const size_t eyes : {1, 2}) {
        CAPTURE(eyes);
        const SyntheticModel model(modelOptions(LevelRule::Round));
        const auto backend = open(model.view()), plain = open(model.view());
        const auto expected = render(*plain, walk(3, eyes), with(ReusePolicy::None));
        const auto first = render(*backend, walk(3, eyes), with(ReusePolicy::Depth));
        for (size_t e = 0; e < eyes; ++e) {
            const EyeCounts& counts = first[e].result.eyes[e];
            CHECK(compare(first[e].pixels, expected[e].pixels).psnr >= 75);
            CHECK(counts.anchors_decoded >= counts.anchors_visible);
            CHECK(counts.anchors_reused == 0);
        }
        CHECK(first[0].result.cache_bytes > 0);
        for (int i = 0; i < 3; ++i) {
            const auto again = render(*backend, walk(3, eyes), with(ReusePolicy::Depth));
            for (size_t e = 0; e < eyes; ++e) {
                const EyeCounts& counts = again[e].result.eyes[e];
                CHECK(sameBytes(again[e].pixels, first[e].pixels));
                CHECK(counts.anchors_decoded == 0);
                CHECK(counts.anchors_reused == counts.anchors_visible);
                CHECK(counts.gaussians_alive > 0);
            }
        }
        backend->dropCaches();
        CHECK(render(*backend, walk(3, eyes), with(ReusePolicy::Depth))[0].result.eyes[0].anchors_reused == 0);
    }
}

TEST_CASE("reuse: depth decides as on a CPU")
{
    for (const DepthGuidance guidance : {DepthGuidance::Linear, DepthGuidance::Exponential, DepthGuidance::Staged}) {
        CAPTURE(int(guidance));
        const SyntheticModel model(modelOptions(LevelRule::Round));
        const auto gpu = open(model.view()), cpu = open(model.view(), "cpu");
        FrameOptions options = with(ReusePolicy::Depth, 3);
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

TEST_CASE("reuse: what a GPU does not do is refused, and the renderer goes on")
{
    const SyntheticModel model(modelOptions());
    Renderer& gpu = cudaRenderer();
    gpu.load(model.view());
    const auto refusal = [&](const FrameOptions& options) {
        std::string text;
        try {
            render(gpu, walk(0, 2), options);
        } catch (const Error& error) {
            CHECK(error.code() == ErrorCode::Unsupported);
            text = error.what();
        }
        return text;
    };
    FrameOptions options = with(ReusePolicy::Depth);
    options.tier = Tier::Exact;
    CHECK(refusal(options).find("tier exact") != std::string::npos);
    for (const Tier tier : {Tier::Fast, Tier::Exact}) {
        options = with(ReusePolicy::Error);
        options.tier = tier;
        CHECK(refusal(options).find("draw with a detail") != std::string::npos);
    }
    CHECK(refusal(with(ReusePolicy::Depth)).empty());
}
