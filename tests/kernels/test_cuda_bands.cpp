// SPDX-License-Identifier: Apache-2.0
// Bands of an image on the device: together they are the image, and each looks at little beside what it shows.
#include "tests/kernels/band_tools.h"
#include "tests/kernels/gpu_tools.h"
#include "tests/kernels/lens_tools.h"

#include <doctest/doctest.h>

#include <numeric>

using namespace gsc;
using namespace gsc::test;

namespace {

SyntheticOptions scene(RasterRules rules, float log_scale = -3)
{
    SyntheticOptions options;
    options.anchors = 1500;
    options.log_scale = log_scale;
    options.raster_rules = rules;
    return options;
}

} // namespace

TEST_CASE("bands of an image: both tiers, both rasterisers, every format, depths, one list of splats and two")
{
    for (const RasterRules rules : {RasterRules::DiffGaussian, RasterRules::Gsplat}) {
        const SyntheticModel model(scene(rules));
        Renderer& gpu = cudaRenderer();
        gpu.load(model.view());
        const std::vector<EyeParams> apart = {eyeAt(0.4f, -5, 143, 90), eyeAt(0.7f, -5, 143, 90)};
        const std::vector<EyeParams> beside = {eyeAhead(0.4f, -5, 143, 90), eyeAhead(0.5f, -5, 143, 90)};
        for (const Tier tier : {Tier::Exact, Tier::Fast}) {
            CAPTURE(uint32_t(tier));
            checkBands(gpu, apart, onGrey(tier), {64}, PixelFormat::Rgb32f, true);
            checkBands(gpu, beside, onGrey(tier), {32, 96}, PixelFormat::Rgba8, true);
            FrameOptions merged = onGrey(tier);
            merged.stereo = StereoMode::Merged;
            checkBands(gpu, beside, merged, {96}, PixelFormat::Rgba16f);
            checkBands(gpu, apart, merged, {64, 128}, PixelFormat::Rgb32f, true);
        }
        checkBands(gpu, {apart[0]}, onGrey(Tier::Fast), {32, 64, 96, 128});
    }
}

TEST_CASE("bands of an image: large Gaussians, bins of twice the height, images of two widths, levels")
{
    Renderer& gpu = cudaRenderer();
    {
        const SyntheticModel model(scene(RasterRules::DiffGaussian, -1.5f));
        gpu.load(model.view());
        checkBands(gpu, {eyeAt(0.4f, -5, 100, 60), eyeAt(0.6f, -5, 130, 50)}, onGrey(Tier::Exact), {64});
        checkBands(gpu, {eyeAt(0.4f, -5, 100, 60), eyeAt(0.6f, -5, 130, 50)}, onGrey(Tier::Fast), {32, 64});
    }
    SyntheticOptions options = scene(RasterRules::DiffGaussian);
    options.levels = 4;
    options.level_rule = LevelRule::Progressive;
    options.flags = kModelHasLevels | kModelLodHalfCell;
    const SyntheticModel model(options);
    gpu.load(model.view());
    for (const Tier tier : {Tier::Exact, Tier::Fast})
        checkBands(gpu, {eyeAhead(0.4f, -6, 40, 4100), eyeAhead(0.5f, -6, 40, 4100)}, onGrey(tier), {32});
}

TEST_CASE("bands of an image: a band decodes what it can show, and CPU and device agree on what that is")
{
    SyntheticOptions options = scene(RasterRules::DiffGaussian, -4.5f);
    options.anchors = 6000;
    const SyntheticModel model(options);
    Renderer& gpu = cudaRenderer();
    gpu.load(model.view());
    const std::vector<EyeParams> eyes = {eyeAt(0.4f, -5, 256, 256)};
    const std::vector<double> shares = checkBands(gpu, eyes, onGrey(Tier::Fast), {128});
    CAPTURE(shares[0]);
    for (const double share : shares)
        CHECK(share < 0.65);
    CHECK(shares[0] + shares[1] >= 0.99);
    // the device's boxes are coarser, and hold all that the CPU's do
    const std::unique_ptr<Renderer> cpu = makeCpuRenderer(CpuPath::Fast, 1);
    cpu->load(model.view());
    FrameOptions band = onGrey(Tier::Fast);
    band.columns = {128, 256};
    CHECK(render(gpu, eyes, band)[0].result.eyes[0].anchors_visible >=
          render(*cpu, eyes, band)[0].result.eyes[0].anchors_visible);
}

TEST_CASE("bands of an image: kept entries, nothing to show, columns that are none")
{
    const SyntheticModel model(scene(RasterRules::DiffGaussian));
    const std::unique_ptr<Renderer> gpu = makeRenderer({"cuda"}), plain = makeRenderer({"cuda"});
    gpu->load(model.view());
    plain->load(model.view());
    for (int i = 0; i < 3; ++i) {
        const std::vector<EyeParams> eyes = {eyeAhead(0.4f + 0.02f * float(i), -5, 143, 90)};
        FrameOptions options = onGrey(Tier::Fast), none = options;
        options.reuse.policy = ReusePolicy::Depth;
        options.reuse.max_depth = 2;
        options.columns = none.columns = {32, 96};
        const auto kept = render(*gpu, eyes, options), wanted = render(*plain, eyes, none);
        CHECK(compare(kept[0].pixels, wanted[0].pixels).psnr >= 35);
        CHECK(std::ranges::count(kept[0].pixels, -7.0f) == 3 * 90 * (143 - 64));
    }
    std::vector<EyeParams> eyes = {eyeAhead(0, -5, 96, 64)};
    eyes[0].world_to_view[11] -= 100; // the model lies behind
    FrameOptions options = onGrey(Tier::Fast);
    const float grey = options.background[0];
    CHECK(std::ranges::count(render(*gpu, eyes, options)[0].pixels, 0.0f) == 3 * 64 * 96);
    options.columns = {32, 64};
    const auto empty = render(*gpu, eyes, options);
    CHECK(empty[0].result.eyes[0].gaussians_visible == 0);
    CHECK(std::ranges::count(empty[0].pixels, grey) == 3 * 64 * 32);
    options.columns = {};
    CHECK(std::ranges::count(render(*gpu, eyes, options)[0].pixels, 0.0f) == 3 * 64 * 96);
    options.columns = {32, 40};
    CHECK_THROWS_AS((void)render(*gpu, eyes, options), Error);
}

TEST_CASE("a lens hides squares of an image: both tiers, every format, depths, one list of splats and two, bands")
{
    const SyntheticModel model(scene(RasterRules::DiffGaussian));
    Renderer& gpu = cudaRenderer();
    gpu.load(model.view());
    const std::vector<EyeParams> apart = {eyeAt(0.4f, -5, 243, 190), eyeAt(0.7f, -5, 243, 190)};
    const std::vector<EyeParams> beside = {eyeAhead(0.4f, -5, 243, 190), eyeAhead(0.5f, -5, 243, 190)};
    const LensShape wide = ellipseLens(apart[0], 0.9), narrow = ellipseLens(apart[0], 0.5);
    for (const Tier tier : {Tier::Exact, Tier::Fast}) {
        CAPTURE(uint32_t(tier));
        CHECK(checkLens(gpu, apart, onGrey(tier), {wide, narrow}, PixelFormat::Rgb32f, true) < 0.95);
        CHECK(checkLens(gpu, beside, onGrey(tier), {narrow, wide}, PixelFormat::Rgba8, true) < 0.95);
        CHECK(checkLens(gpu, beside, onGrey(tier), {narrow, narrow}, PixelFormat::Rgba16f) < 0.9);
        checkLens(gpu, {apart[0]}, onGrey(tier), {narrow});
        FrameOptions band = onGrey(tier);
        std::ranges::fill(band.lens, narrow);
        checkBands(gpu, apart, band, {64, 128}, PixelFormat::Rgba8);
    }
    // lenses off their axes: the second eye's columns are shifted in the lists of both
    const std::vector<EyeParams> shifted = {offCentre(beside[0], -0.3f, 0), offCentre(beside[1], 0.3f, 0)};
    CHECK(checkLens(gpu, shifted, onGrey(Tier::Fast), {wide, narrow}, PixelFormat::Rgb32f, true) < 0.95);
    CHECK(checkLens(gpu, shifted, onGrey(Tier::Fast), {narrow, narrow}, PixelFormat::Rgba8) < 0.9);
    checkLens(gpu, {eyeAhead(0.4f, -6, 40, 4100)}, onGrey(Tier::Fast),
              {ellipseLens(eyeAhead(0.4f, -6, 40, 4100), 0.8)});
    const std::vector<LensShape> closed(2, LensShape{{}, {}, true});
    CHECK(checkLens(gpu, beside, onGrey(Tier::Fast), closed) == 0); // nothing is seen
}
