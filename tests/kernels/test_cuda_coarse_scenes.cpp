// SPDX-License-Identifier: Apache-2.0
// FrameOptions::detail on a GPU with the scenes that every backend is tried with.
#include "tests/kernels/coarse_scene.h"

#include <doctest/doctest.h>

using namespace gsc;
using namespace gsc::test;

namespace {

std::unique_ptr<Renderer> openCuda(const ModelView& model)
{
    std::unique_ptr<Renderer> gpu = makeRenderer({"cuda"});
    gpu->load(model);
    return gpu;
}

} // namespace

TEST_CASE("coarse: every input of the networks, other rules and positions, and slots that are masked")
{
    const auto model = coarseModelOfAll();
    const auto coarse = openCuda(model->view()), plain = openCuda(model->view());
    FrameOptions options = detailed(2, Tier::Fast);
    options.appearance = 1;
    for (int i = 0; i < 5; ++i) {
        CAPTURE(i);
        CoarseCounts counts;
        CHECK(detailLoss(*coarse, *plain, farWalk(i), options, &counts) > 34);
        CHECK(coarseGroups(counts) > 0);
        CHECK((counts.kept > 0) == (i > 0));
    }
}

TEST_CASE("coarse: the view of ages shows frames since a copy was made")
{
    const auto model = coarseModel();
    checkCoarseAges(*openCuda(model->view()), detailed(2, Tier::Fast), 3, 5e-3f);
}
