// SPDX-License-Identifier: Apache-2.0
// Reuse on a GPU: it decides as on a CPU, says what it does not do, and nothing depends on the order of atomics or on how
// often a frame was drawn.
#include <gsc/error.h>
#include "tests/backends/reuse_scene.h"
#include "tests/kernels/gpu_tools.h"
#include "tests/support/outcome.h"

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
                FrameOptions options = with(ReusePolicy::Depth, 0, 0), none = with(ReusePolicy::None);
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
                    const bool together = limit == 0 || stereo == StereoMode::Merged; // decoded for both eyes
                    CHECK(double(actual[0].result.eyes[0].pairs) < pairs * (together ? 1.01 : 2));
                }
            }
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
    const uint64_t context = roomy->device().context_bytes; // no budget makes the context smaller
    uint64_t part = render(*roomy, eyes, options)[0].result.bytes_resident - context;
    uint32_t most = 1;
    try {
        for (; most == 1; part = part * 15 / 16) {
            const uint64_t budget = context + part;
            const auto gpu = open(model.view(), {"cuda"}, {0, budget});
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

TEST_CASE("reuse: depth decides as on a CPU")
{
    for (const DepthGuidance guidance : {DepthGuidance::Linear, DepthGuidance::Exponential, DepthGuidance::Staged}) {
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

TEST_CASE("reuse: frames that were drawn again for want of room decide as those that were not, and twice the same")
{
    SyntheticOptions many = modelOptions();
    many.anchors = 600 * kManyAnchors;
    many.log_scale = -0.3f; // more bins of every splat than there is room for at first
    const SyntheticModel model(many);
    uint64_t repeats = 0;
    for (const StereoMode stereo : {StereoMode::Exact, StereoMode::Merged})
        for (const bool ample : {true, false}) {
            CAPTURE(int(stereo));
            CAPTURE(ample);
            const float apart = ample ? 0.3f : 0.03f;
            const auto eyes = [&](int i) { // the last frame is larger, and too large on the way
                const uint32_t width = i < 2 ? 130 : 260, height = i < 2 ? 80 : 160;
                const float x = 0.4f + 0.05f * float(i);
                return std::vector<EyeParams>{eyeAhead(x, -4.5f, width, height),
                                              eyeAhead(x + apart, -4.5f, width, height)};
            };
            FrameOptions options = with(ReusePolicy::Depth, 0, 1);
            options.stereo = stereo;
            options.reuse.cache_bytes = ample ? 0 : (48u << 10) * kManyAnchors;
            const auto fresh = open(model.view()), warm = open(model.view());
            (void)render(*warm, eyes(2), options);
            warm->dropCaches();
            for (int i = 0; i < 3; ++i) {
                CAPTURE(i);
                const auto a = render(*fresh, eyes(i), options), b = render(*warm, eyes(i), options);
                repeats += a[0].result.repeats;
                CHECK(a[0].result.passes == 1); // several would keep nothing
                CHECK(b[0].result.repeats == 0);
                CHECK(a[0].result.cache_evictions == b[0].result.cache_evictions);
                for (size_t e = 0; e < 2; ++e) {
                    const EyeCounts &got = a[e].result.eyes[e], &want = b[e].result.eyes[e];
                    CHECK(sameBytes(a[e].pixels, b[e].pixels));
                    CHECK(got.anchors_decoded == want.anchors_decoded);
                    CHECK(got.anchors_reused == want.anchors_reused);
                }
            }
        }
    CHECK(repeats > 0);
}

TEST_CASE("reuse: dropped caches give their memory back")
{
    const SyntheticModel model(modelOptions());
    const auto backend = open(model.view());
    const FrameResult kept = render(*backend, walk(0, 1), with(ReusePolicy::Depth))[0].result;
    backend->dropCaches();
    const FrameResult none = render(*backend, walk(0, 1), with(ReusePolicy::None))[0].result;
    CHECK(none.cache_bytes == 0);
    const FrameResult again = render(*backend, walk(0, 1), with(ReusePolicy::Depth))[0].result;
    CHECK(again.cache_bytes == kept.cache_bytes);
    CHECK(again.bytes_resident == kept.bytes_resident);
}
