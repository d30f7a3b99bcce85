// SPDX-License-Identifier: Apache-2.0
// Acceptance: cities of 1.3 M anchors come out of `gsc sample replicate` with the bytes they always had, and
// --tier exact draws the trainers' own pictures of them on the CPU, both eyes.
#include "tests/player/golden_city.h"
#include "tests/player/golden_picture.h"

#include <doctest/doctest.h>

using namespace gsc;

namespace {

constexpr test::PictureBar kBar = {102, test::kWorstPixel};

void checkOnCpu(const std::string& name)
{
    const std::unique_ptr<test::City> city = test::openCity(name);
    if (!city)
        return;
    const std::unique_ptr<Renderer> backend = makeCpuRenderer(CpuPath::Fast, 0);
    backend->load(city->scene().view());
    for (const test::CityFrame& frame : city->golden().frames)
        test::checkFrame(*city, frame, city->render(*backend, frame.index, Tier::Exact), "cpu exact", kBar);
}

} // namespace

TEST_CASE("the CPU draws the trainers' pictures of scaffold_1300000")
{
    checkOnCpu("scaffold_1300000");
}

TEST_CASE("the CPU draws the trainers' pictures of octree_1300000")
{
    checkOnCpu("octree_1300000");
}
