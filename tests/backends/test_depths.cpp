// SPDX-License-Identifier: Apache-2.0
// Depths of pixels (FrameTarget::depth).
#include "tests/backends/reuse_scene.h"

#include <doctest/doctest.h>

using namespace gsc;
using namespace gsc::test;

TEST_CASE("depths are those of another renderer, whatever a frame is drawn by, and the picture beside them is the same")
{
    for (const RasterRules rules : {RasterRules::DiffGaussian, RasterRules::Gsplat}) {
        SyntheticOptions made = modelOptions();
        made.raster_rules = rules;
        const SyntheticModel model(made);
        const auto renderer = open(model.view()), judge = open(model.view(), kBackend.judge);
        const std::vector<EyeParams> eyes = walk(0, 2);
        std::vector<std::vector<float>> pictures;
        const auto wanted = renderDepths(*judge, eyes, onGrey(), pictures); // the judge has one tier
        for (const FrameOptions& options : waysToDraw(0, 2)) {
            CAPTURE(uint32_t(options.tier));
            CAPTURE(uint32_t(options.reuse.policy));
            const bool exact = options.tier == Tier::Exact;
            const auto got = renderDepths(*renderer, eyes, options, pictures);
            const auto plain = render(*renderer, eyes, options);
            for (size_t e = 0; e < 2; ++e) {
                CHECK(otherDepths(wanted[e], got[e], exact ? 1e-5 : 1e-4) < (exact ? 1e-3 : kBackend.other_depths));
                CHECK(std::ranges::count(got[e], INFINITY) > 100);
                CHECK(std::ranges::count_if(got[e], [](float z) { return z < 100; }) > 100);
                CHECK(sameBytes(pictures[e], plain[e].pixels));
            }
        }
    }
}

TEST_CASE("depths where nothing is are infinite")
{
    const SyntheticModel model({.anchors = 1});
    std::vector<EyeParams> behind = walk(0, 1);
    behind[0].world_to_view[11] -= 100; // all of the model
    std::vector<std::vector<float>> pictures;
    for (const char* name : {kBackend.name, "cpu-reference"}) {
        const auto depths = renderDepths(*open(model.view(), name), behind, FrameOptions{}, pictures)[0];
        CHECK(size_t(std::ranges::count(depths, INFINITY)) == depths.size());
    }
}
