// SPDX-License-Identifier: Apache-2.0
// Bands of an image on the CPU: the bound that says what a band can show, and the bytes that come of it.
#include "kernels/math/band.h"
#include "kernels/math/projection.h"
#include "tests/backends/backend.h"
#include "tests/kernels/band_tools.h"
#include "tests/kernels/lens_tools.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

using namespace gsc;
using namespace gsc::test;

namespace {

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
    for (const RasterRules raster : {RasterRules::DiffGaussian, RasterRules::Gsplat}) {
        const RasterConstants rules = rulesOf(raster);
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

TEST_CASE("bands: the scalar reference draws them too, and images of two widths")
{
    const SyntheticModel model(bandScene(RasterRules::DiffGaussian, -3, 3000));
    const auto reference = open(model.view(), kBackend.judge), fast = open(model.view());
    std::vector<EyeParams> eyes = eyesApart(97, 70);
    checkBands(*reference, eyes, onGrey(), {32, 64}, PixelFormat::Rgba8, true);
    eyes[1] = eyesApart(161, 90)[1];
    checkBands(*reference, eyes, onGrey(), {64}, PixelFormat::Rgb32f, true);
    checkBands(*fast, eyes, onGrey(), {64, 96}, PixelFormat::Rgb32f, true);
}

TEST_CASE("bands: a band decodes what it can show and little more")
{
    SyntheticOptions options = bandScene(RasterRules::DiffGaussian, -4.5f, 3000);
    options.anchors = 20000;
    const SyntheticModel model(options);
    const std::vector<double> shares = checkBands(*open(model.view()), eyesApart(512, 512), onGrey(), {128, 256, 384});
    CAPTURE(shares[1]);
    for (const double share : shares)
        CHECK(share < 0.5);
    CHECK(std::accumulate(shares.begin(), shares.end(), 0.0) < 1.3);
    CHECK(std::accumulate(shares.begin(), shares.end(), 0.0) >= 0.99); // anchors that nothing shows are seldom decoded
}

TEST_CASE("a lens hides squares of an image of the scalar reference")
{
    const SyntheticModel model(bandScene(RasterRules::DiffGaussian, -3, 3000));
    const std::vector<EyeParams> eyes = eyesApart(203, 150);
    const LensShape wide = ellipseLens(eyes[0], 0.9), narrow = ellipseLens(eyes[0], 0.5);
    const auto reference = open(model.view(), kBackend.judge);
    checkLens(*reference, eyes, onGrey(), {wide, narrow}, PixelFormat::Rgb32f, true);
    checkLens(*reference, eyes, onGrey(), {narrow, wide}, PixelFormat::Rgba8);
    checkLens(*reference, {eyes[0]}, onGrey(), {LensShape{{}, {}, true}}); // nothing is seen
    FrameOptions band = onGrey();
    std::ranges::fill(band.lens, narrow);
    checkBands(*reference, eyes, band, {64});
}
