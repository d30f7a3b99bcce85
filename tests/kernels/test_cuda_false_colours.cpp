// SPDX-License-Identifier: Apache-2.0
// False colours on a GPU: those of the CPU, and nothing of them is left in the pictures that follow.
#include "tests/kernels/false_colour_tools.h"
#include "tests/kernels/reuse_tools.h"

#include <doctest/doctest.h>

using namespace gsc;
using namespace gsc::test;

namespace {

std::vector<EyeParams> ahead(int i)
{
    const float x = 0.2f + 0.02f * float(i);
    return {eyeAhead(x, -5, 128, 96), eyeAhead(x + 0.1f, -5, 128, 96)};
}

FrameOptions viewed(FrameOptions options, FrameView view)
{
    options.view = view;
    return options;
}

} // namespace

TEST_CASE("false colours: levels and ages are the CPU's, in both tiers, of eyes with and without bins of their own")
{
    for (const LevelRule rule : {LevelRule::None, LevelRule::Round}) {
        const SyntheticModel model(modelOptions(rule));
        const auto gpu = open(model.view()), cpu = open(model.view(), "cpu");
        for (const Tier tier : {Tier::Exact, Tier::Fast})
            for (const StereoMode stereo : {StereoMode::Exact, StereoMode::Merged})
                for (const FrameView view : {FrameView::Picture, FrameView::Level, FrameView::Age})
                    for (const bool shared : {false, true}) {
                        CAPTURE(int(tier));
                        CAPTURE(int(stereo));
                        CAPTURE(int(view));
                        CAPTURE(shared);
                        FrameOptions options = viewed(onGrey(tier), view);
                        options.stereo = stereo;
                        const auto eyes = shared ? ahead(0) : viewEyes(0, 2);
                        const auto a = render(*gpu, eyes, options), b = render(*cpu, eyes, options);
                        for (size_t e = 0; e < 2; ++e)
                            CHECK(compare(a[e].pixels, b[e].pixels).psnr > (tier == Tier::Exact ? 90 : 60));
                    }
        checkLevels(*gpu, model.view(), viewEyes(0, 2), onGrey(Tier::Exact));
        checkLevels(*gpu, model.view(), viewEyes(0, 2), onGrey(Tier::Fast));
    }
}

TEST_CASE("false colours: counts of the pixels are those of the frame")
{
    for (const RasterRules rules : {RasterRules::DiffGaussian, RasterRules::Gsplat}) {
        SyntheticOptions of = modelOptions(LevelRule::Round);
        of.raster_rules = rules;
        const SyntheticModel model(of);
        const auto gpu = open(model.view());
        for (const Tier tier : {Tier::Exact, Tier::Fast}) {
            CAPTURE(int(rules));
            CAPTURE(int(tier));
            checkCost(*gpu, viewEyes(0, 2), viewed(onGrey(tier), FrameView::Cost));
            checkCost(*gpu, ahead(0), viewed(onGrey(tier), FrameView::Cost));
        }
        checkCost(*gpu, ahead(0), viewed(with(ReusePolicy::Depth, 3), FrameView::Cost));
    }
}

TEST_CASE("false colours: costs are of the CPU's order, and none is what nothing reaches")
{
    const SyntheticModel model(modelOptions());
    const FrameOptions options = viewed(onGrey(Tier::Exact), FrameView::Cost);
    const auto gpu = countsOf(render(*open(model.view()), viewEyes(0, 1), options)[0].pixels);
    const auto cpu = countsOf(render(*open(model.view(), "cpu"), viewEyes(0, 1), options)[0].pixels);
    double of_gpu = 0, of_cpu = 0;
    for (size_t i = 0; i < gpu.size(); ++i) { // sub-tiles are of another size than the CPU's blocks
        of_gpu += gpu[i];
        of_cpu += cpu[i];
    }
    CHECK(of_gpu < 2 * of_cpu);
    CHECK(of_cpu < 2 * of_gpu);
}

TEST_CASE("false colours: change no byte of the pictures around them, with and without reuse")
{
    const SyntheticModel model(modelOptions(LevelRule::Round));
    for (const ReusePolicy policy : {ReusePolicy::None, ReusePolicy::Depth}) {
        CAPTURE(int(policy));
        checkSwitching(*open(model.view()), *open(model.view()), with(policy, 3), 5);
    }
    FrameOptions merged = with(ReusePolicy::Depth, 3);
    merged.stereo = StereoMode::Merged;
    checkSwitching(*open(model.view()), *open(model.view()), merged, 5);
    checkSwitching(*open(model.view()), *open(model.view()), onGrey(Tier::Exact), 5);
}

TEST_CASE("false colours: what is kept grows old, and what is decoded anew is young again")
{
    const SyntheticModel model(modelOptions(LevelRule::Round));
    for (const StereoMode stereo : {StereoMode::Exact, StereoMode::Merged}) {
        FrameOptions options = with(ReusePolicy::Depth, 3);
        options.stereo = stereo;
        checkAges(*open(model.view()), options);
    }
}
