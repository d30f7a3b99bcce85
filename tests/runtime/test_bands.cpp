// SPDX-License-Identifier: Apache-2.0
// Bands of an image on the CPU: the bound that says what a band can show, and the bytes that come of it.
#include "kernels/math/band.h"
#include "kernels/math/projection.h"
#include "tests/kernels/band_tools.h"
#include "tests/kernels/lens_tools.h"
#include "tests/kernels/synthetic_model.h"
#include "tests/runtime/reuse_tools.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

using namespace gsc;
using namespace gsc::test;

namespace {

SyntheticOptions modelOf(RasterRules rules, float log_scale)
{
    SyntheticOptions options;
    options.anchors = 3000;
    options.log_scale = log_scale;
    options.raster_rules = rules;
    return options;
}

std::vector<EyeParams> twoEyes(uint32_t width, uint32_t height)
{
    const float left[3] = {0.4f, -0.3f, -5}, right[3] = {0.7f, -0.3f, -5}, middle[3] = {0, 0, 0};
    return {lookAt(left, middle, 1.1f, width, height), lookAt(right, middle, 1.1f, width, height)};
}

FrameOptions onGreyGround()
{
    FrameOptions options;
    std::fill_n(options.background, 3, 0.5f);
    return options;
}

// A Gaussian somewhere, of any shape, and the eye's tiles that it touches.
struct AnyGaussian {
    float position[3], sigma;
    TileRect tiles;
    bool visible;
};

AnyGaussian anyGaussian(Random& random, const EyeParams& eye, const RasterConstants& rules)
{
    AnyGaussian g{};
    float scale[3], q[4];
    const float size = std::exp(random.uniform(-7, 1));
    for (int i = 0; i < 3; ++i) {
        g.position[i] = random.uniform(-4, 4);
        scale[i] = size * (random.uniform() < 0.3f ? 1.0f : random.uniform());
        g.sigma = std::max(g.sigma, scale[i]);
    }
    for (float& v : q)
        v = random.normal();
    normalizeQuaternion(q);
    const auto f = footprint<float>(eye, rules, Vec3<float>{g.position[0], g.position[1], g.position[2]}, scale, q);
    g.tiles = f.tiles;
    g.visible = f.visible && f.finite;
    return g;
}

} // namespace

TEST_CASE("bands: no Gaussian that touches a tile of a band is rejected, and few others are kept")
{
    Random random(5);
    for (const bool gsplat : {false, true}) {
        ModelParams params{};
        params.raster_rules = uint32_t(gsplat ? RasterRules::Gsplat : RasterRules::DiffGaussian);
        params.near_z = 0.2f;
        const RasterConstants rules = rasterConstants(params, 0);
        size_t wrong = 0, touching = 0, kept = 0, shown = 0, missed_if_tighter = 0;
        for (int view = 0; view < 300; ++view) {
            EyeParams eye = randomEye(random, 5);
            if (view % 3 == 0)
                eye = offCentre(eye, random.uniform(-0.4f, 0.4f), random.uniform(-0.4f, 0.4f));
            const uint32_t steps = (eye.width + kColumnStep - 1) / kColumnStep;
            const auto first = uint32_t(random.uniform() * float(steps));
            const ColumnRange columns{first * kColumnStep, (first + 1 + uint32_t(random.uniform() * 3)) * kColumnStep};
            const EyeBand band = eyeBand(eye, columns);
            EyeBand tighter = band;
            for (BoundPlane& plane : tighter.planes)
                plane.sigma_factor *= 0.7f;
            const ColumnRange pixels = columns.within(eye.width);
            for (int i = 0; i < 300; ++i) {
                const AnyGaussian g = anyGaussian(random, eye, rules);
                if (!g.visible)
                    continue;
                const bool touches =
                    uint32_t(g.tiles.x0) * kTileSize < pixels.end && uint32_t(g.tiles.x1) * kTileSize > pixels.first;
                const bool may = mayTouch(band, g.position, g.position, g.sigma);
                ++shown;
                touching += touches;
                kept += may;
                wrong += touches && !may;
                missed_if_tighter += touches && !mayTouch(tighter, g.position, g.position, g.sigma);
            }
        }
        CAPTURE(touching);
        CAPTURE(kept);
        CAPTURE(shown);
        CHECK(wrong == 0);
        CHECK(touching > 5000);
        CHECK(kept < shown);
        CHECK(double(kept) < 1.35 * double(touching));
        CHECK(missed_if_tighter > 0); // the bound is not far from what there is
    }
}

TEST_CASE("bands: together they are the image, byte for byte, in any format, and the rest of a target stays")
{
    for (const RasterRules rules : {RasterRules::DiffGaussian, RasterRules::Gsplat})
        for (const float log_scale : {-3.5f, -2.0f}) {
            CAPTURE(log_scale);
            const SyntheticModel model(modelOf(rules, log_scale));
            const auto renderer = open(model.view());
            const std::vector<EyeParams> eyes = twoEyes(203, 150);
            for (const PixelFormat format : {PixelFormat::Rgb32f, PixelFormat::Rgba16f, PixelFormat::Rgba8})
                checkBands(*renderer, eyes, onGreyGround(), {96, 128}, format, format != PixelFormat::Rgba16f);
            checkBands(*renderer, {eyes[0]}, onGreyGround(), {32, 64, 96, 128, 160, 192}, PixelFormat::Rgb32f, true);
            FrameOptions merged = onGreyGround();
            merged.stereo = StereoMode::Merged;
            checkBands(*renderer, eyes, merged, {64, 160}, PixelFormat::Rgba8, true);
        }
}

TEST_CASE("bands: the scalar reference draws them too, and images of two widths")
{
    const SyntheticModel model(modelOf(RasterRules::DiffGaussian, -3));
    const auto reference = makeCpuRenderer(CpuPath::Reference, 1), fast = open(model.view());
    reference->load(model.view());
    std::vector<EyeParams> eyes = twoEyes(97, 70);
    checkBands(*reference, eyes, onGreyGround(), {32, 64}, PixelFormat::Rgba8, true);
    eyes[1] = twoEyes(161, 90)[1];
    checkBands(*reference, eyes, onGreyGround(), {64}, PixelFormat::Rgb32f, true);
    checkBands(*fast, eyes, onGreyGround(), {64, 96}, PixelFormat::Rgb32f, true);
}

TEST_CASE("bands: levels that fade and lag")
{
    SyntheticOptions options = modelOf(RasterRules::DiffGaussian, -3);
    options.levels = 4;
    options.level_rule = LevelRule::Round;
    options.flags = kModelHasLevels | kModelLodHalfCell;
    const SyntheticModel model(options);
    FrameOptions frame = onGreyGround();
    frame.lod_fade = 0.5f;
    frame.lod_hysteresis = 0.5f;
    checkBands(*open(model.view()), twoEyes(140, 100), frame, {64}, PixelFormat::Rgb32f, true);
}

TEST_CASE("bands: a band decodes what it can show and little more")
{
    SyntheticOptions options = modelOf(RasterRules::DiffGaussian, -4.5f);
    options.anchors = 20000;
    const SyntheticModel model(options);
    const std::vector<double> shares =
        checkBands(*open(model.view()), twoEyes(512, 512), onGreyGround(), {128, 256, 384});
    CAPTURE(shares[1]);
    for (const double share : shares)
        CHECK(share < 0.5);
    CHECK(std::accumulate(shares.begin(), shares.end(), 0.0) < 1.3);
    CHECK(std::accumulate(shares.begin(), shares.end(), 0.0) >= 0.99); // that nothing shows is seldom decoded
}

TEST_CASE("bands: kept entries draw them within the bound")
{
    const SyntheticModel model(modelOf(RasterRules::DiffGaussian, -3));
    for (const ReusePolicy policy : {ReusePolicy::Error, ReusePolicy::Depth}) {
        CAPTURE(uint32_t(policy));
        const auto plain = open(model.view()), reusing = open(model.view());
        FrameOptions options = with(policy, 0.5f, 2), none = options;
        none.reuse = {};
        for (int i = 0; i < 4; ++i) {
            const std::vector<EyeParams> eyes = walk(i, 2);
            const auto whole = render(*plain, eyes, none);
            options.columns = {32, 64};
            const auto band = render(*reusing, eyes, options);
            for (size_t e = 0; e < 2; ++e) {
                const auto cut = [&](const std::vector<float>& p) { return columnsOf(p, eyes[e].width, {32, 64}); };
                CHECK(compare(cut(band[e].pixels), cut(whole[e].pixels)).psnr >= 35);
                CHECK(size_t(std::ranges::count(band[e].pixels, -7.0f)) >=
                      3 * (eyes[e].width - 32) * size_t(eyes[e].height));
            }
        }
    }
}

TEST_CASE("bands: where nothing is there is the background, never upstream's black")
{
    const SyntheticModel model(modelOf(RasterRules::DiffGaussian, -3));
    std::vector<EyeParams> eyes = twoEyes(96, 64);
    for (EyeParams& eye : eyes)
        eye.world_to_view[11] -= 100; // the model lies behind
    const auto fast = open(model.view()), reference = makeCpuRenderer(CpuPath::Reference, 1);
    reference->load(model.view());
    FrameOptions options = onGreyGround();
    for (Renderer* renderer : {fast.get(), reference.get()}) {
        options.columns = {};
        CHECK(std::ranges::count(render(*renderer, eyes, options)[1].pixels, 0.0f) == 3 * 64 * 96);
        options.columns = {64, 96};
        const auto band = render(*renderer, eyes, options);
        CHECK(band[1].result.eyes[1].gaussians_visible == 0); // by which a caller knows
        CHECK(std::ranges::count(band[1].pixels, 0.5f) == 3 * 64 * 32);
        CHECK(std::ranges::count(band[1].pixels, -7.0f) == 3 * 64 * 64);
    }
}

TEST_CASE("bands: columns that are none are refused")
{
    const SyntheticModel model(modelOf(RasterRules::DiffGaussian, -3));
    const auto renderer = open(model.view());
    const std::vector<EyeParams> eyes = twoEyes(100, 64);
    for (const ColumnRange& columns : {ColumnRange{16, 64}, ColumnRange{0, 40}, ColumnRange{64, 64},
                                       ColumnRange{96, 32}, ColumnRange{128, 256}, ColumnRange{32, 0}}) {
        CAPTURE(columns.first);
        FrameOptions options;
        options.columns = columns;
        try {
            (void)render(*renderer, eyes, options);
            CHECK(false);
        } catch (const Error& error) {
            CHECK(error.code() == ErrorCode::Usage);
            CHECK(std::string(error.what()).find("expected multiples of 32") != std::string::npos);
        }
    }
    FrameOptions options;
    options.columns = {96, 4096};
    (void)render(*renderer, eyes, options);
}

TEST_CASE("a lens hides squares of an image on the CPU: they are black, cost nothing, and change no other")
{
    const SyntheticModel model(modelOf(RasterRules::DiffGaussian, -3));
    const std::vector<EyeParams> eyes = twoEyes(203, 150);
    const LensShape wide = ellipseLens(eyes[0], 0.9), narrow = ellipseLens(eyes[0], 0.5);
    for (const CpuPath path : {CpuPath::Fast, CpuPath::Reference}) {
        const std::unique_ptr<Renderer> cpu = makeCpuRenderer(path, 2);
        cpu->load(model.view());
        const double left = checkLens(*cpu, eyes, onGreyGround(), {wide, narrow}, PixelFormat::Rgb32f, true);
        CHECK((path == CpuPath::Reference || left < 0.95));
        checkLens(*cpu, eyes, onGreyGround(), {narrow, wide}, PixelFormat::Rgba8);
        checkLens(*cpu, {eyes[0]}, onGreyGround(), {LensShape{{}, {}, true}}); // nothing is seen
        FrameOptions band = onGreyGround();
        std::ranges::fill(band.lens, narrow);
        checkBands(*cpu, eyes, band, {64});
    }
    FrameOptions far = onGreyGround();
    far.near_z = 1000; // no Gaussian at all: what is seen is the background
    far.empty_is_black = false;
    const std::unique_ptr<Renderer> cpu = makeCpuRenderer(CpuPath::Fast, 1);
    cpu->load(model.view());
    checkLens(*cpu, eyes, far, {wide, narrow}, PixelFormat::Rgba8);
}
