// SPDX-License-Identifier: Apache-2.0
// Scenes of the tests of reuse, on a CPU and on a GPU.
#pragma once

#include "tests/kernels/render_tools.h"
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

// The paper's loop before a camera that stands still: every entry is decoded again after `depth` frames, once for both
// eyes. Two backends, one that decodes for each eye beside it.
inline void checkPaperLoop(Renderer& together, Renderer& apart, FrameOptions each)
{
    each.reuse.policy = ReusePolicy::Depth;
    each.reuse.max_depth = 3;
    FrameOptions merged = each;
    merged.stereo = StereoMode::Merged;
    const auto decodedBy = [](const std::vector<Image<float>>& images) {
        const EyeCounts* const eyes = images[0].result.eyes;
        return eyes[0].anchors_decoded + eyes[1].anchors_decoded;
    };
    for (int i = 0; i < 9; ++i) {
        CAPTURE(i);
        const auto one = render(together, walk(0, 2), merged), two = render(apart, walk(0, 2), each);
        CHECK((decodedBy(one) > 0) == (i % 4 == 0)); // all entries are of one age
        CHECK(double(decodedBy(one)) <= 0.6 * double(decodedBy(two)));
        for (size_t e = 0; e < 2; ++e)
            CHECK(compare(one[e].pixels, two[e].pixels).psnr > 25);
    }
    // what was decoded for both is not what an eye of its own keeps
    CHECK(decodedBy(render(together, walk(0, 2), each)) > 0);
}

} // namespace gsc::test
