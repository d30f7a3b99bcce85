// SPDX-License-Identifier: Apache-2.0
// Scenes of the tests of reuse, on a CPU and on a GPU.
#pragma once

#include "tests/backends/backend.h"
#include "tests/kernels/synthetic_model.h"

#include <doctest/doctest.h>

#include <vector>

namespace gsc::test {

inline SyntheticOptions modelOptions(LevelRule rule = LevelRule::None)
{
    return octree(rule, 1200, 7);
}

// Frame `i` of a walk round the model, eyes `apart` world units from each other.
inline std::vector<EyeParams> walk(int i, size_t eye_count, float apart = 0.1f)
{
    std::vector<EyeParams> eyes;
    for (size_t e = 0; e < eye_count; ++e) {
        const float position[3] = {0.2f + 0.02f * float(i) + apart * float(e), 0.3f, -5 + 0.01f * float(i)};
        const float target[3] = {0.1f, -0.2f, 0.3f};
        eyes.push_back(lookAt(position, target, 0.9f, 120, 90));
    }
    return eyes;
}

// That `options` draws over a walk what no reuse does, but for the half precision of the entries.
inline void checkLikeNone(const ModelView& model, const FrameOptions& options, size_t eye_count)
{
    const auto plain = open(model), reusing = open(model);
    FrameOptions none = options;
    none.reuse = {};
    for (int i = 0; i < kBackend.frames; ++i) {
        CAPTURE(i);
        const auto expected = render(*plain, walk(i, eye_count), none);
        const auto actual = render(*reusing, walk(i, eye_count), options);
        for (size_t e = 0; e < eye_count; ++e) {
            const EyeCounts &got = actual[e].result.eyes[e], &want = expected[e].result.eyes[e];
            CHECK(compare(actual[e].pixels, expected[e].pixels).psnr >= kBackend.kept_db);
            CHECK(got.anchors_visible == want.anchors_visible);
            CHECK(double(got.gaussians_visible) == doctest::Approx(double(want.gaussians_visible)).epsilon(0.005));
        }
    }
}

} // namespace gsc::test
