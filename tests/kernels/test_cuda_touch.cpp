// SPDX-License-Identifier: Apache-2.0
// The codes by which long lists find what a small splat touches, against every pixel that the splat draws.
#include "kernels/blend/blend_cuda.h"
#include "tests/kernels/blend_scene.h"
#include "tests/kernels/gpu_decode.h"

#include <doctest/doctest.h>

#include <cmath>

using namespace gsc;
using namespace gsc::test;

namespace {

constexpr int kTileRows = 8; // rows of a sub-tile of a long list; its columns are kTouchColumn

// A code's pixels, near enough to the splat to be told from those 64 away.
struct Box {
    int x0, y0, x1, y1;
};

Box boxOf(uint32_t code, const PackedSplat& s)
{
    const auto nearest = [](double about, uint32_t value, uint32_t modulo) { // `value` modulo `modulo`, next to `about`
        return int(value) + int(modulo) * int(std::lround((about - double(value)) / double(modulo)));
    };
    const int column = nearest(s.x / kTouchColumn - 1, code & 15u, 16), row = nearest(s.y - 4, code >> 6 & 63u, 64);
    return {column * int(kTouchColumn), row, (column + int(code >> 4 & 3u) + 1) * int(kTouchColumn) - 1,
            row + int(code >> 12)};
}

struct Counts {
    uint32_t coded = 0, drawn = 0, missed = 0, extra = 0;
};

// Pixels that the splat draws outside of its box, and pixels of sub-tiles in the box that it would draw but for upstream's
// square. A pixel that rounding may decide counts as neither.
void check(const Emitted<PackedSplat>& emitted, const EyeParams& eye, const RasterConstants& rules, Counts& counts)
{
    const PackedSplat& s = emitted.splat;
    if (emitted.touch >> 12 == kTouchUnknown >> 12)
        return;
    ++counts.coded;
    const Box box = boxOf(emitted.touch, s);
    const double a = s.factor[0], b = s.factor[1], c = s.factor[2], radius = spreadOf(s, rules).radius;
    for (int y = std::max(int(s.y) - 24, 0); y <= std::min(int(s.y) + 24, int(eye.height) - 1); ++y)
        for (int x = std::max(int(s.x) - 24, 0); x <= std::min(int(s.x) + 24, int(eye.width) - 1); ++x) {
            const double dx = double(s.x) - x, dy = double(s.y) - y, u = a * dx + b * dy, v = c * dy;
            const double alpha = stepsFloat(s.opacity) * std::exp2(-u * u - v * v);
            const auto covered = [&](double r) { return inTiles(s, rules, r, uint32_t(x), uint32_t(y)); };
            const bool in = x >= box.x0 && x <= box.x1 && y >= box.y0 && y <= box.y1;
            const bool in_rows = x >= box.x0 && x <= box.x1 && y / kTileRows >= box.y0 / kTileRows &&
                                 y / kTileRows <= box.y1 / kTileRows;
            if (alpha >= (1 + 1e-4) / 255) {
                counts.drawn += covered(std::ceil(radius + 1e-3));
                counts.missed += covered(std::ceil(radius - 1e-3)) && !in;
                counts.extra += in_rows && !covered(std::ceil(radius + 1e-3)) && !covered(std::ceil(radius - 1e-3));
            }
        }
}

} // namespace

TEST_CASE("decode fast: a code holds every pixel that its splat draws, and none that upstream's square cuts off")
{
    for (const RasterRules raster : {RasterRules::DiffGaussian, RasterRules::Gsplat}) {
        CAPTURE(uint32_t(raster));
        Counts counts;
        uint32_t all = 0;
        for (const float log_scale : {-3.5f, -2.2f, -1.2f}) {
            SyntheticOptions options{.anchors = 400, .raster_rules = raster, .log_scale = log_scale};
            const SyntheticModel synthetic(syntheticParams(options), randomAnchors(options), randomMlps(options), {},
                                           0);
            StageModel model(synthetic.view());
            const DecodeJob job =
                decodeJob(synthetic.view(), model, {eyeAt(0.4f, -5, 150, 110), eyeAt(1.9f, -4, 97, 143)}, 400);
            const Decoded<PackedSplat> decoded = decodeOnDevice<PackedSplat>(job);
            for (uint32_t e = 0; e < 2; ++e)
                for (const auto& [order, emitted] : decoded.eyes[e]) {
                    check(emitted, job.eyes[e], rasterConstants(*job.view->params, 0), counts);
                    ++all;
                }
        }
        CHECK(counts.missed == 0);
        CHECK(counts.extra == 0);
        CHECK(counts.drawn > 10'000);
        CHECK(counts.coded > 500);
        CHECK(counts.coded < all); // large ones have none
    }
}
