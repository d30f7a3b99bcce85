// SPDX-License-Identifier: Apache-2.0
// Acceptance on a GPU, a city to a test case: the trainers' own pictures in both tiers, and in --tier exact the CPU's,
// frames 0 and 20, whether the trainers have drawn them or not.
// A city of 18.5 M anchors takes 12 GB of the temporary folder while it is made, 6 GB afterwards.
#include "runtime/cuda/renderer_cuda.h"
#include "tests/player/golden_city.h"
#include "tests/player/golden_picture.h"

#include <doctest/doctest.h>

using namespace gsc;

namespace {

constexpr test::PictureBar kExactBar = {102, test::kWorstPixel};
constexpr test::PictureBar kFastBar = {78.5, 1};     // features are halves there: the mean is held, no single pixel
constexpr double kCpuBar = 102, kCpuPooledBar = 105; // dB between GPU and CPU

PooledDifference& differenceToCpu()
{
    static PooledDifference pooled; // difference over every city that ran
    return pooled;
}

void checkOnGpu(const std::string& name)
{
    const std::unique_ptr<test::City> city = test::openCity(name);
    if (!city)
        return;
    const std::unique_ptr<Renderer> cuda = makeCudaRenderer(0, {}), cpu = makeCpuRenderer(CpuPath::Fast, 0);
    cuda->load(city->scene().view());
    cpu->load(city->scene().view());
    REQUIRE(cuda->tierOf(Tier::Fast) == Tier::Fast);
    for (const test::CityFrame& frame : city->golden().frames)
        test::checkFrame(*city, frame, city->render(*cuda, frame.index, Tier::Fast), "cuda fast", kFastBar);
    for (const size_t index : {0, 20}) {
        const test::CityView exact = city->render(*cuda, index, Tier::Exact),
                             expected = city->render(*cpu, index, Tier::Exact);
        for (const test::CityFrame& frame : city->golden().frames) {
            if (frame.index != index)
                continue;
            test::checkFrame(*city, frame, exact, "cuda exact", kExactBar);
            test::checkFrame(*city, frame, expected, "cpu exact", kExactBar);
        }
        test::checkViews(*city, index, exact, expected, "cuda exact and cpu exact", kCpuBar, differenceToCpu());
    }
}

} // namespace

TEST_CASE("the GPU draws the trainers' pictures of scaffold_1300000")
{
    checkOnGpu("scaffold_1300000");
}

TEST_CASE("the GPU draws the trainers' pictures of octree_1300000")
{
    checkOnGpu("octree_1300000");
}

TEST_CASE("the GPU draws the trainers' pictures of scaffold_18500000")
{
    checkOnGpu("scaffold_18500000");
}

TEST_CASE("the GPU draws the trainers' pictures of octree_18500000")
{
    checkOnGpu("octree_18500000");
}

// The last one: it judges what the others have drawn. -tc chooses it by "*pooled*".
TEST_CASE("the GPU draws the CPU's pictures of these cities, pooled")
{
    const PooledDifference& pooled = differenceToCpu();
    if (pooled.frames == 0)
        return;
    test::printPooled("cuda exact and cpu exact,", pooled);
    CHECK(pooled.psnr() >= kCpuPooledBar);
}
