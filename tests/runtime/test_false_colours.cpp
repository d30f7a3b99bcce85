// SPDX-License-Identifier: Apache-2.0
// False colours on a CPU: what they show, and that they leave nothing behind.
#include <gsc/error.h>
#include "runtime/view/colour_legend.h"
#include "tests/kernels/false_colour_tools.h"
#include "tests/runtime/reuse_tools.h"

#include <doctest/doctest.h>

using namespace gsc;
using namespace gsc::test;

TEST_CASE("ramps: their ends, their steps, and one colour for one count")
{
    const auto is = [](const FalseColour& a, float r, float g, float b) { return a.r == r && a.g == g && a.b == b; };
    CHECK(logSteps(0) == 0);
    CHECK(logSteps(1) == 1);
    CHECK(logSteps(2) == 1.5f);
    CHECK(logSteps(255) == 8);
    CHECK(logSteps(UINT32_MAX) == 24);
    CHECK(is(ageColour(0), 0, 0, 1));
    CHECK(is(ageColour(15), 0, 1, 0));
    CHECK(is(ageColour(255), 1, 0, 0));
    CHECK(is(ageColour(UINT32_MAX), 1, 0, 0));
    CHECK(is(costColour(0), 0, 0, 0));
    CHECK(is(costColour(7), 0, 0, 1));
    CHECK(is(costColour(63), 1, 0, 0));
    CHECK(is(costColour(511), 1, 1, 0));
    CHECK(is(costColour(4095), 1, 1, 1));
    CHECK(is(costColour(UINT32_MAX), 1, 1, 1));
    CHECK(countsByColour().size() == 4096);
    for (int32_t level = 0; level < 12; ++level)
        for (int32_t other = 0; other < level; ++other) {
            const FalseColour a = levelColour(level);
            CHECK_FALSE(is(levelColour(other), a.r, a.g, a.b));
        }
    for (uint32_t source = 0; source < 4; ++source)
        for (uint32_t other = 0; other < source; ++other) {
            const FalseColour a = detailColour(GroupSource(source)), b = detailColour(GroupSource(other));
            CHECK(std::abs(a.r - b.r) + std::abs(a.g - b.g) + std::abs(a.b - b.b) > 0.5f);
        }
    const FalseColour grey = levelColour(11);
    CHECK(is(grey, grey.r, grey.r, grey.r));
    CHECK(is(levelColour(-12), levelColour(0).r, levelColour(0).g, levelColour(0).b));
}

TEST_CASE("a legend has the colours that are drawn, each with a word; a picture has none")
{
    CHECK(colourLegend(FrameView::Picture, 3).empty());
    CHECK(colourLegend(FrameView::Level, 3).size() == 3);
    CHECK(colourLegend(FrameView::Age, 1)[2].text == "15");
    CHECK(colourLegend(FrameView::Cost, 1)[4].text == "4095");
    const std::vector<LegendColour> groups = colourLegend(FrameView::Detail, 1);
    REQUIRE(groups.size() == 4);
    const char* const words[] = {"near", "kept", "stale", "made"};
    for (uint32_t i = 0; i < 4; ++i) {
        const FalseColour drawn = detailColour(GroupSource(i));
        CHECK(groups[i].text == words[i]);
        CHECK(groups[i].rgb[0] == drawn.r);
        CHECK(groups[i].rgb[1] == drawn.g);
        CHECK(groups[i].rgb[2] == drawn.b);
    }
}

TEST_CASE("views change no byte of the pictures around them, with and without reuse")
{
    const SyntheticModel model(modelOptions(LevelRule::Round));
    for (const StereoMode stereo : {StereoMode::Exact, StereoMode::Merged})
        for (const ReusePolicy policy : {ReusePolicy::None, ReusePolicy::Depth, ReusePolicy::Error}) {
            if (stereo == StereoMode::Merged && policy == ReusePolicy::Error)
                continue;
            CAPTURE(int(stereo));
            CAPTURE(int(policy));
            FrameOptions options = with(policy, 2, 3);
            options.stereo = stereo;
            checkSwitching(*open(model.view()), *open(model.view()), options);
        }
}

TEST_CASE("level: every pixel is a mixture of the levels' colours, and light ends where it did")
{
    for (const LevelRule rule : {LevelRule::None, LevelRule::Round})
        for (const ReusePolicy policy : {ReusePolicy::None, ReusePolicy::Error}) {
            CAPTURE(int(rule));
            const SyntheticModel model(modelOptions(rule));
            const auto fast = open(model.view());
            FrameOptions options = with(policy);
            checkLevels(*fast, model.view(), viewEyes(0, 2), options);
        }
}

TEST_CASE("views of the scalar reference are those of the fast renderer")
{
    const SyntheticModel model(modelOptions(LevelRule::Round));
    const auto fast = open(model.view());
    const auto reference = makeCpuRenderer(CpuPath::Reference, 1);
    reference->load(model.view());
    for (const FrameView view : {FrameView::Picture, FrameView::Level, FrameView::Age}) {
        FrameOptions options = with(ReusePolicy::None);
        options.view = view;
        const auto a = render(*fast, viewEyes(0, 2), options), b = render(*reference, viewEyes(0, 2), options);
        for (size_t e = 0; e < 2; ++e)
            CHECK(compare(a[e].pixels, b[e].pixels).psnr > 90);
    }
    FrameOptions options = with(ReusePolicy::None);
    options.view = FrameView::Cost;
    checkCost(*reference, viewEyes(0, 2), options);
}

TEST_CASE("cost: counts of the pixels are those of the frame")
{
    const SyntheticModel model(modelOptions(LevelRule::Round));
    const auto backend = open(model.view());
    for (const ReusePolicy policy : {ReusePolicy::None, ReusePolicy::Error}) {
        FrameOptions options = with(policy);
        options.view = FrameView::Cost;
        checkCost(*backend, viewEyes(0, 2), options);
    }
    SyntheticOptions gsplat = modelOptions();
    gsplat.raster_rules = RasterRules::Gsplat;
    const SyntheticModel other(gsplat);
    FrameOptions options = with(ReusePolicy::None);
    options.view = FrameView::Cost;
    checkCost(*open(other.view()), viewEyes(0, 1), options);
}

TEST_CASE("age: a camera that stands still sees what it kept grow old, and what is decoded anew is young again")
{
    const SyntheticModel model(modelOptions(LevelRule::Round));
    for (const StereoMode stereo : {StereoMode::Exact, StereoMode::Merged}) {
        FrameOptions options = with(ReusePolicy::Depth, 0, 3);
        options.stereo = stereo;
        checkAges(*open(model.view()), options);
    }
}

TEST_CASE("a view that there is not is refused")
{
    const SyntheticModel model(modelOptions());
    FrameOptions options;
    options.view = FrameView(kFrameViews);
    CHECK_THROWS_WITH_AS((void)render(*open(model.view()), walk(0, 1), options),
                         doctest::Contains("view 5, expected 0 to 4"), Error);
}
