// SPDX-License-Identifier: Apache-2.0
// A far scene of fine Gaussians for tests of FrameOptions::detail.
#pragma once

#include "tests/backends/backend.h"
#include "tests/kernels/synthetic_model.h"

#include <doctest/doctest.h>

#include <cmath>
#include <memory>
#include <vector>

namespace gsc::test {

// Some dozen groups of fine Gaussians, 8 units wide, those of an anchor apart from each other.
inline std::unique_ptr<SyntheticModel> coarseModel(SyntheticOptions options)
{
    options.anchors = 6000;
    options.log_scale = -4;
    options.seed = 11;
    SyntheticAnchors anchors = randomAnchors(options);
    for (size_t a = 0; a < anchors.count(); ++a)
        std::fill_n(anchors.scale.data() + 6 * a, 3, -1.0f);
    if ((options.flags & kModelMaskedSlots) != 0)
        maskSlots(anchors, options.n_offsets);
    Random random(3);
    std::vector<float> rows(size_t(options.appearance_dim) * options.appearance_rows);
    for (float& value : rows)
        value = random.normal();
    return std::make_unique<SyntheticModel>(syntheticParams(options), anchors, randomMlps(options), rows,
                                            options.cell_log2);
}

inline std::unique_ptr<SyntheticModel> coarseModel(LevelRule rule = LevelRule::None)
{
    return coarseModel(octree(rule));
}

// Frame `i` of a walk that the model is far from for the most part: a step is a forty thousandth of the distance.
inline std::vector<EyeParams> farWalk(int i, size_t eye_count = 2, float distance = 40, float turned = 0)
{
    std::vector<EyeParams> eyes;
    for (size_t e = 0; e < eye_count; ++e) {
        const float position[3] = {0.001f * float(i) + 0.06f * float(e), 0.3f, -distance};
        const float target[3] = {0.1f + distance * std::tan(turned), -0.2f, 0.3f};
        eyes.push_back(lookAt(position, target, 0.6f, 160, 120));
    }
    return eyes;
}

inline uint64_t coarseGroups(const CoarseCounts& counts)
{
    return counts.kept + counts.stale + counts.made;
}

// PSNR of a frame of `coarse` against one of `plain` without detail, the worse of the eyes.
inline double detailLoss(Renderer& coarse, Renderer& plain, const std::vector<EyeParams>& eyes, FrameOptions options,
                         CoarseCounts* counts = nullptr)
{
    const auto actual = render(coarse, eyes, options);
    options.detail = 0;
    const auto expected = render(plain, eyes, options);
    double worst = 200;
    for (size_t e = 0; e < eyes.size(); ++e)
        worst = std::min(worst, compare(actual[e].pixels, expected[e].pixels).psnr);
    if (counts != nullptr)
        *counts = actual[0].result.coarse;
    return worst;
}

} // namespace gsc::test
