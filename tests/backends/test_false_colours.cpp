// SPDX-License-Identifier: Apache-2.0
// False colours: what they show, and that nothing of them is left in the pictures that follow.
#include "tests/backends/false_colour_tools.h"

#include <doctest/doctest.h>

using namespace gsc;
using namespace gsc::test;

TEST_CASE("false colours: every pixel is a mixture of the levels' colours, and light ends where it did")
{
    for (const LevelRule rule : {LevelRule::None, LevelRule::Round}) {
        CAPTURE(int(rule));
        const SyntheticModel model(modelOptions(rule));
        for (const FrameOptions& options : waysToDraw())
            checkLevels(*open(model.view()), model.view(), viewEyes(0, 2), options);
    }
}

TEST_CASE("false colours: counts of the pixels are those of the frame")
{
    for (const RasterRules rules : {RasterRules::DiffGaussian, RasterRules::Gsplat}) {
        CAPTURE(int(rules));
        SyntheticOptions of = modelOptions(LevelRule::Round);
        of.raster_rules = rules;
        const SyntheticModel model(of);
        const auto renderer = open(model.view());
        for (FrameOptions options : waysToDraw()) {
            CAPTURE(int(options.tier));
            CAPTURE(int(options.reuse.policy));
            options.view = FrameView::Cost;
            checkCost(*renderer, viewEyes(0, 2), options);
            checkCost(*renderer, viewsAhead(), options);
        }
    }
}

TEST_CASE("false colours: change no byte of the pictures around them, with and without reuse")
{
    const SyntheticModel model(modelOptions(LevelRule::Round));
    for (FrameOptions options : waysToDraw(2))
        for (const StereoMode stereo : {StereoMode::Exact, StereoMode::Merged}) {
            if (stereo == StereoMode::Merged && options.reuse.policy == ReusePolicy::Error)
                continue;
            CAPTURE(int(options.tier));
            CAPTURE(int(options.reuse.policy));
            CAPTURE(int(stereo));
            options.stereo = stereo;
            checkSwitching(*open(model.view()), *open(model.view()), options);
        }
}

TEST_CASE("false colours: what is kept grows old, and what is decoded anew is young again")
{
    const SyntheticModel model(modelOptions(LevelRule::Round));
    for (const StereoMode stereo : {StereoMode::Exact, StereoMode::Merged}) {
        FrameOptions options = with(ReusePolicy::Depth, 0, 3);
        options.stereo = stereo;
        checkAges(*open(model.view()), options);
    }
}

TEST_CASE("false colours: without detail every group is near, however it is drawn")
{
    const SyntheticModel model(modelOptions(LevelRule::Round));
    const auto check = [&](Renderer& renderer, FrameOptions options, float slack) {
        options.view = FrameView::Detail;
        std::fill_n(options.background, 3, 0.0f);
        checkOneColour(render(renderer, viewEyes(0, 2), options), detailColour(GroupSource::Near), slack);
    };
    const auto renderer = open(model.view());
    for (const FrameOptions& options : waysToDraw())
        check(*renderer, options, 2e-3f);
    check(*open(model.view(), "cpu-reference"), onGrey(Tier::Exact), 1e-4f);
}
