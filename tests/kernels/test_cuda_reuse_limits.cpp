// SPDX-License-Identifier: Apache-2.0
// Reuse on a GPU: its memory has a limit, and nothing depends on the order of atomics or on how often a frame was drawn.
#include "tests/kernels/reuse_tools.h"

#include <doctest/doctest.h>

using namespace gsc;
using namespace gsc::test;

TEST_CASE("reuse: a small cache holds its limit, gives up what was drawn least recently, and draws the same")
{
    const SyntheticModel model(modelOptions());
    FrameOptions options = with(ReusePolicy::Depth);
    options.reuse.cache_bytes = 30u << 10;
    const float center[3] = {0, 0, 0};
    const auto look = [&](float z) {
        const float target[3] = {0.1f, 0.2f, z};
        return std::vector<EyeParams>{lookAt(center, target, 0.8f, 64, 64)};
    };
    const auto backend = open(model.view());
    const auto plain = open(model.view());
    uint64_t evicted = 0;
    for (int i = 0; i < 6; ++i) {
        const std::vector<EyeParams> eyes = look(i % 2 == 0 ? 9.0f : -9.0f); // two views that share little
        const auto image = render(*backend, eyes, options);
        evicted += image[0].result.cache_evictions;
        CHECK(compare(image[0].pixels, render(*plain, eyes, with(ReusePolicy::None))[0].pixels).psnr >= 75);
        // tables that find an entry, and histograms, are not part of the limit
        CHECK(image[0].result.cache_bytes < options.reuse.cache_bytes + (384u << 10));
    }
    CHECK(evicted > 0);
    // what stays in view stays kept
    const auto twice = render(*backend, look(-9.0f), options);
    CHECK(twice[0].result.eyes[0].anchors_reused > twice[0].result.eyes[0].anchors_visible / 2);

    options.reuse.max_depth = 0;
    options.reuse.cache_bytes = 1; // room for nothing
    checkLikeNone(model.view(), options, 2);
    options.reuse.cache_bytes = 20 << 10; // for some strips
    checkLikeNone(model.view(), options, 2);
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
            FrameOptions options = with(ReusePolicy::Depth, 1);
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
