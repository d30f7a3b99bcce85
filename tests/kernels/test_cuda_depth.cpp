// SPDX-License-Identifier: Apache-2.0
// Depths of pixels of frames that are drawn in several passes.
#include "tests/backends/reuse_scene.h"
#include "tests/kernels/gpu_tools.h"

#include <doctest/doctest.h>

using namespace gsc;
using namespace gsc::test;

namespace {

// Between the budget that one pass needs and the least that a frame does there is little on a large device.
#ifdef GSC_CUDA_EMULATION
constexpr uint64_t kBudgetStep = 22; // thirty-seconds
#else
constexpr uint64_t kBudgetStep = 31;
#endif

} // namespace

TEST_CASE("depths of several passes are those of one")
{
    const SyntheticModel model({.anchors = 6000 * kManyAnchors, .log_scale = -3.5f});
    const std::vector<EyeParams> eyes = walk(0, 2);
    const uint64_t context = cudaRenderer().device().context_bytes;
    for (const Tier tier : {Tier::Fast, Tier::Exact}) {
        const auto whole = open(model.view());
        std::vector<std::vector<float>> pictures;
        const auto wanted = renderDepths(*whole, eyes, onGrey(tier), pictures);
        const uint64_t all = render(*whole, eyes, onGrey(tier))[0].result.bytes_resident - context;
        uint32_t passes = 1;
        for (uint64_t part = all; part > all / 8 && passes == 1; part = part * kBudgetStep / 32) {
            const auto gpu = open(model.view(), {"cuda"}, {0, context + part});
            const auto got = renderDepths(*gpu, eyes, onGrey(tier), pictures);
            std::vector<float> depth(wanted[0].size());
            FrameTarget targets[2] = {hostTarget(pictures[0].data()), {}};
            targets[0].depth = depth.data();
            passes = render(*gpu, {eyes, targets, onGrey(tier)}).passes;
            for (size_t e = 0; e < 2; ++e)
                CHECK(otherDepths(wanted[e], got[e], 0) < (tier == Tier::Exact ? 1e-9 : 1e-3));
            CHECK(depth == got[0]);
        }
        CHECK(passes > 1);
    }
}
