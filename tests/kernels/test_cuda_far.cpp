// SPDX-License-Identifier: Apache-2.0
// Models far from the world's origin on the CUDA backend.
#include "runtime/model/local_model.h"
#include "tests/kernels/gpu_tools.h"
#include "tests/kernels/moved_model.h"

#include <doctest/doctest.h>

#include <cstdlib>

using namespace gsc;
using namespace gsc::test;

TEST_CASE("100 km away, both tiers draw the pictures of the origin, with levels and without")
{
    for (const bool levels : {false, true}) {
        CAPTURE(levels);
        const SyntheticModel model(octree(levels ? LevelRule::Round : LevelRule::None, 1500, 1));
        int32_t cells[3];
        farCells(model.view(), cells);
        const MovedModel far(model.view(), cells);
        const LocalModel local(far.view(), localOrigin(far.view()).value());
        std::vector<EyeParams> at_origin, moved, world;
        for (const float x : {0.4f, 0.46f}) {
            const Camera camera = cameraAt(x, -5, 150, 110), away = movedCamera(camera, far.by());
            at_origin.push_back(eyeParams(camera, {}));
            moved.push_back(eyeParams(away, local.view().origin));
            world.push_back(eyeParams(away, {}));
        }
        checkFrame(local.view(), moved, onGrey(Tier::Exact));
        for (const Tier tier : {Tier::Exact, Tier::Fast}) {
            CAPTURE(uint32_t(tier));
            const auto shoot = [&](const ModelView& view, const std::vector<EyeParams>& eyes) {
                cudaRenderer().load(view);
                return render(cudaRenderer(), eyes, onGrey(tier));
            };
            const auto expected = shoot(model.view(), at_origin), actual = shoot(local.view(), moved);
            const auto before = shoot(far.view(), world);
            for (uint32_t e = 0; e < 2; ++e) {
                const double after_db = compare(actual[e].pixels, expected[e].pixels).psnr;
                const double before_db = compare(before[e].pixels, expected[e].pixels).psnr;
                if (std::getenv("GSC_TEST_VERBOSE") != nullptr)
                    MESSAGE(after_db, " dB, as fp32 has it there ", before_db, " dB");
                CHECK(actual[e].result.eyes[e].anchors_visible == expected[e].result.eyes[e].anchors_visible);
                CHECK(after_db >= 90);
                CHECK(before_db < 60);
            }
        }
    }
}
