// SPDX-License-Identifier: Apache-2.0
// Bands of an image: together they are the image, and each looks at little beside what it shows. Lenses hide the rest.
#include "tests/backends/reuse_scene.h"
#include "tests/kernels/band_tools.h"
#include "tests/kernels/lens_tools.h"
#include "tests/support/outcome.h"

#include <doctest/doctest.h>

#include <numeric>

using namespace gsc;
using namespace gsc::test;

namespace {

// Two that look the same way, and so share their bins.
std::vector<EyeParams> eyesBeside(uint32_t width, uint32_t height, float z = -5)
{
    return {eyeAhead(0.4f, z, width, height), eyeAhead(0.5f, z, width, height)};
}

} // namespace

TEST_CASE("bands of an image: every tier, both rasterisers, every format, depths, one list of splats and two")
{
    for (const RasterRules rules : {RasterRules::DiffGaussian, RasterRules::Gsplat}) {
        const SyntheticModel model(bandScene(rules));
        const auto renderer = open(model.view());
        const std::vector<EyeParams> apart = eyesApart(143, 90), beside = eyesBeside(143, 90);
        for (const Tier tier : kBackend.tiers) {
            CAPTURE(uint32_t(tier));
            checkBands(*renderer, apart, onGrey(tier), {64}, PixelFormat::Rgb32f, true);
            checkBands(*renderer, beside, onGrey(tier), {32, 96}, PixelFormat::Rgba8, true);
            FrameOptions merged = mergedEyes(onGrey(tier));
            checkBands(*renderer, beside, merged, {96}, PixelFormat::Rgba16f);
            checkBands(*renderer, apart, merged, {64, 128}, PixelFormat::Rgb32f, true);
        }
        checkBands(*renderer, {apart[0]}, onGrey(), {32, 64, 96, 128});
    }
}

TEST_CASE(
    "bands of an image: large Gaussians, bins of twice the height, images of two widths, levels that fade and lag")
{
    const std::vector<EyeParams> two_widths = {eyeAt(0.4f, -5, 100, 60), eyeAt(0.6f, -5, 130, 50)};
    const SyntheticModel large(bandScene(RasterRules::DiffGaussian, -1.5f));
    for (const Tier tier : kBackend.tiers)
        checkBands(*open(large.view()), two_widths, onGrey(tier), {32, 64}, PixelFormat::Rgb32f, true);
    for (const LevelRule rule : {LevelRule::Progressive, LevelRule::Round}) {
        const SyntheticModel model(octree(rule, 1500, 1));
        const auto renderer = open(model.view());
        FrameOptions frame = onGrey();
        frame.lod_fade = frame.lod_hysteresis = 0.5f;
        if (rule == LevelRule::Round)
            checkBands(*renderer, eyesApart(140, 100), frame, {64}, PixelFormat::Rgb32f, true);
        else
            for (const Tier tier : kBackend.tiers)
                checkBands(*renderer, eyesBeside(40, 4100, -6), onGrey(tier), {32});
    }
}

TEST_CASE("bands of an image: kept entries")
{
    const SyntheticModel model(bandScene(RasterRules::DiffGaussian));
    for (const ReusePolicy policy : kBackend.policies) {
        CAPTURE(uint32_t(policy));
        const auto plain = open(model.view()), reusing = open(model.view());
        for (int i = 0; i < 4; ++i) {
            const std::vector<EyeParams> eyes = walk(i, 2);
            FrameOptions options = with(policy, 0.5f, 2);
            options.columns = {32, 64};
            const auto kept = render(*reusing, eyes, options);
            options.reuse = {};
            const auto wanted = render(*plain, eyes, options);
            for (size_t e = 0; e < 2; ++e) {
                const auto cut = [&](const std::vector<float>& p) { return columnsOf(p, eyes[e].width, {32, 64}); };
                CHECK(compare(cut(kept[e].pixels), cut(wanted[e].pixels)).psnr >= 35);
                CHECK(size_t(std::ranges::count(kept[e].pixels, -7.0f)) ==
                      3 * (eyes[e].width - 32) * size_t(eyes[e].height));
            }
        }
    }
}

TEST_CASE("bands of an image: where nothing is there is the background, never upstream's black")
{
    const SyntheticModel model(bandScene(RasterRules::DiffGaussian));
    std::vector<EyeParams> eyes = eyesBeside(96, 64);
    for (EyeParams& eye : eyes)
        eye.world_to_view[11] -= 100; // the model lies behind
    for (const char* name : {kBackend.name, "cpu-reference"}) {
        const auto renderer = open(model.view(), name);
        FrameOptions options = onGrey();
        for (int i = 0; i < 2; ++i) {
            options.columns = {};
            CHECK(std::ranges::count(render(*renderer, eyes, options)[1].pixels, 0.0f) == 3 * 64 * 96);
            options.columns = {64, 96};
            const auto band = render(*renderer, eyes, options);
            CHECK(band[1].result.eyes[1].gaussians_visible == 0); // by which a caller knows
            CHECK(std::ranges::count(band[1].pixels, options.background[0]) == 3 * 64 * 32);
            CHECK(std::ranges::count(band[1].pixels, -7.0f) == 3 * 64 * 64);
        }
    }
}

TEST_CASE("bands of an image: columns that are none are refused")
{
    const SyntheticModel model(bandScene(RasterRules::DiffGaussian));
    const auto renderer = open(model.view());
    const auto refused = [&](const ColumnRange& columns) {
        FrameOptions options;
        options.columns = columns;
        return outcomeOf([&] { (void)render(*renderer, eyesApart(100, 64), options); });
    };
    for (const ColumnRange& columns : {ColumnRange{16, 64}, ColumnRange{0, 40}, ColumnRange{64, 64},
                                       ColumnRange{96, 32}, ColumnRange{128, 256}, ColumnRange{32, 0}}) {
        CAPTURE(columns.first);
        CHECK(refused(columns).code == ErrorCode::Usage);
        CHECK(refused(columns).says("expected multiples of 32"));
    }
    CHECK(refused({96, 4096}).code == ErrorCode::Ok);
}

TEST_CASE("a lens hides squares of an image: every tier, every format, depths, one list of splats and two, bands")
{
    const SyntheticModel model(bandScene(RasterRules::DiffGaussian));
    const auto renderer = open(model.view());
    const std::vector<EyeParams> apart = eyesApart(243, 190), beside = eyesBeside(243, 190);
    const LensShape wide = ellipseLens(apart[0], 0.9), narrow = ellipseLens(apart[0], 0.5);
    for (const Tier tier : kBackend.tiers) {
        CAPTURE(uint32_t(tier));
        CHECK(checkLens(*renderer, apart, onGrey(tier), {wide, narrow}, PixelFormat::Rgb32f, true) < 0.95);
        CHECK(checkLens(*renderer, beside, onGrey(tier), {narrow, wide}, PixelFormat::Rgba8, true) < 0.95);
        CHECK(checkLens(*renderer, beside, onGrey(tier), {narrow, narrow}, PixelFormat::Rgba16f) < 0.9);
        checkLens(*renderer, {apart[0]}, onGrey(tier), {narrow});
        FrameOptions band = onGrey(tier);
        std::ranges::fill(band.lens, narrow);
        checkBands(*renderer, apart, band, {64, 128}, PixelFormat::Rgba8);
    }
    // lenses off their axes: the second eye's columns are shifted in the lists of both
    const std::vector<EyeParams> shifted = {offCentre(beside[0], -0.3f, 0), offCentre(beside[1], 0.3f, 0)};
    CHECK(checkLens(*renderer, shifted, onGrey(), {wide, narrow}, PixelFormat::Rgb32f, true) < 0.95);
    CHECK(checkLens(*renderer, shifted, onGrey(), {narrow, narrow}, PixelFormat::Rgba8) < 0.9);
    const EyeParams high = eyeAhead(0.4f, -6, 40, 4100);
    checkLens(*renderer, {high}, onGrey(), {ellipseLens(high, 0.8)});
    const std::vector<LensShape> closed(2, LensShape{{}, {}, true});
    CHECK(checkLens(*renderer, beside, onGrey(), closed) == 0); // nothing is seen
    FrameOptions far = onGrey();
    far.near_z = 1000; // no Gaussian at all: what is seen is the background
    far.empty_is_black = false;
    checkLens(*renderer, apart, far, {wide, narrow}, PixelFormat::Rgba8);
}
