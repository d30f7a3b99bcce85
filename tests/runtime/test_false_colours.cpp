// SPDX-License-Identifier: Apache-2.0
// False colours on a CPU: their ramps and legends, and the scalar reference.
#include <gsc/error.h>
#include "runtime/view/colour_legend.h"
#include "tests/backends/false_colour_tools.h"

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

TEST_CASE("views of the scalar reference are those of the fast renderer")
{
    const SyntheticModel model(modelOptions(LevelRule::Round));
    const auto fast = open(model.view());
    const auto reference = open(model.view(), "cpu-reference");
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

TEST_CASE("a view that there is not is refused")
{
    const SyntheticModel model(modelOptions());
    FrameOptions options;
    options.view = FrameView(kFrameViews);
    CHECK_THROWS_WITH_AS((void)render(*open(model.view()), walk(0, 1), options),
                         doctest::Contains("view 5, expected 0 to 4"), Error);
}
