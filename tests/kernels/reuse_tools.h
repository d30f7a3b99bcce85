// SPDX-License-Identifier: Apache-2.0
// Scenes of the tests of reuse on a GPU, and pictures to compare with.
#pragma once

#include "tests/kernels/gpu_tools.h"
#include "tests/kernels/reuse_scene.h"

#include <doctest/doctest.h>

#include <cstring>
#include <memory>
#include <vector>

namespace gsc::test {

inline FrameOptions with(ReusePolicy policy, uint32_t depth = 10)
{
    FrameOptions options = onGrey(Tier::Fast);
    options.reuse.policy = policy;
    options.reuse.max_depth = depth;
    return options;
}

inline std::unique_ptr<Renderer> open(const ModelView& model, const char* name = "cuda")
{
    std::unique_ptr<Renderer> backend = makeRenderer({name}, {1});
    backend->load(model);
    return backend;
}

// That `options` draws over a walk what no reuse does, but for the half precision of the entries.
inline void checkLikeNone(const ModelView& model, const FrameOptions& options, size_t eye_count, int frames = 4)
{
    const auto plain = open(model), reusing = open(model);
    FrameOptions none = options;
    none.reuse = {};
    for (int i = 0; i < frames; ++i) {
        CAPTURE(i);
        const auto expected = render(*plain, walk(i, eye_count), none);
        const auto actual = render(*reusing, walk(i, eye_count), options);
        for (size_t e = 0; e < eye_count; ++e) {
            const EyeCounts &got = actual[e].result.eyes[e], &want = expected[e].result.eyes[e];
            CHECK(compare(actual[e].pixels, expected[e].pixels).psnr >= 75);
            CHECK(got.anchors_visible == want.anchors_visible);
            CHECK(double(got.gaussians_visible) == doctest::Approx(double(want.gaussians_visible)).epsilon(0.005));
        }
    }
}

} // namespace gsc::test
