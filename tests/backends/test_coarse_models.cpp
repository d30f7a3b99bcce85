// SPDX-License-Identifier: Apache-2.0
// FrameOptions::detail with every kind of model, eye and frame, and what makes copies anew.
#include "runtime/model/local_model.h"
#include "tests/kernels/band_tools.h"
#include "tests/backends/coarse_scene.h"
#include "tests/backends/false_colour_tools.h"
#include "tests/backends/far_scene.h"
#include "tests/kernels/moved_model.h"

#include <doctest/doctest.h>

#include <functional>

using namespace gsc;
using namespace gsc::test;

namespace {

SyntheticOptions withLevels(LevelRule rule, uint32_t anchors)
{
    SyntheticOptions options = farOptions(anchors);
    options.levels = 3;
    options.level_rule = rule;
    options.flags = kModelHasLevels | kModelLodHalfCell;
    return options;
}

SyntheticOptions withRows(uint32_t anchors = 4096)
{
    SyntheticOptions options = farOptions(anchors);
    options.appearance_dim = 8;
    options.appearance_rows = 3;
    options.inputs = kMlpTakesAppearance;
    return options;
}

// Levels end about where the plate is.
void reachTheFar(SyntheticModel& model)
{
    model.params().standard_dist = 64;
}

// Once copies are made: the eyes' pictures against those of all Gaussians, decibels; the worse.
double likeAll(const ModelView& model, const std::vector<EyeParams>& eyes, FrameOptions options)
{
    const auto coarse = open(model);
    const auto now = settled(*coarse, eyes, options);
    const CoarseCounts& counts = now[0].result.coarse;
    CHECK(counts.kept > groupsOf(counts) * 4 / 5);
    options.detail = 0;
    const auto all = render(*coarse, eyes, options);
    double least = 200;
    for (size_t e = 0; e < eyes.size(); ++e) {
        const EyeCounts &few = now[e].result.eyes[e], &many = all[e].result.eyes[e];
        CHECK(few.gaussians_visible < many.gaussians_visible * 2 / 5);
        CHECK(many.gaussians_visible > 4000);
        least = std::min(least, psnr(now[e], all[e]));
        if (std::getenv("GSC_TEST_VERBOSE") != nullptr)
            MESSAGE(psnr(now[e], all[e]), " dB, near ", counts.near, ", kept ", counts.kept, ", ",
                    few.gaussians_visible, " of ", many.gaussians_visible);
    }
    return least;
}

struct Asked {
    std::vector<EyeParams> eyes = {farEye()};
    FrameOptions options = detailed(2);
};

// After a change of what is asked for: what a renderer draws that drew something else before is what one draws that did not.
void checkForgets(const ModelView& model, const Asked& before, const Asked& after, bool at_once = false)
{
    const auto old = open(model), fresh = open(model);
    const auto was = settled(*old, before.eyes, before.options);
    CHECK(was[0].result.coarse.kept > 0);
    if (at_once) {
        const FrameResult next = render(*old, after.eyes, after.options)[0].result;
        // photographs that each have a row of their own would make copies that nobody draws
        CHECK((next.coarse.made > 0) == (kBackend.makes_all || before.options.appearance == after.options.appearance));
        CHECK(next.eyes[0].anchors_reused == 0);
    }
    const auto now = settled(*old, after.eyes, after.options), want = settled(*fresh, after.eyes, after.options);
    CHECK(now[0].result.coarse.kept == want[0].result.coarse.kept);
    CHECK(now[0].result.coarse.stale == 0);
    CHECK(sameBytes(now[0].pixels, want[0].pixels));
    CHECK_FALSE(sameBytes(now[0].pixels, was[0].pixels));
}

// FrameView::Age of young copies, over black: least and most green of the pixels by their blue, as ageColour() mixes them.
std::pair<float, float> agesShown(const std::vector<Image<float>>& images, float slack)
{
    std::pair<float, float> shown(1.0f, 0.0f);
    size_t others = 0;
    for (const Image<float>& image : images)
        for (size_t p = 0; p < image.pixels.size(); p += 3)
            if (const float blue = image.pixels[p + 2]; blue > 0.5f) {
                others += image.pixels[p] > slack;
                shown.first = std::min(shown.first, image.pixels[p + 1] / blue);
                shown.second = std::max(shown.second, image.pixels[p + 1] / blue);
            }
    CHECK(others == 0);
    return shown;
}

} // namespace

TEST_CASE("coarse: models of few and many Gaussians per anchor, compact, with a bank and with every input")
{
    for (const uint32_t k : {5u, 12u}) {
        CAPTURE(k);
        SyntheticOptions options = farOptions(k == 5 ? 6000 : 4096);
        options.n_offsets = k;
        options.raster_rules = k == 5 ? RasterRules::Gsplat : RasterRules::DiffGaussian;
        CHECK(likeAll(FarModel(options).view(), {farEye()}, detailed(2)) >= 36);
    }
    SyntheticOptions bank = withRows();
    bank.flags |= kModelFeatureBank | kModelBankDistance;
    bank.inputs |= kMlpTakesDistance;
    FrameOptions of_row = detailed(2);
    of_row.appearance = 1;
    CHECK(likeAll(FarModel(bank).view(), {farEye()}, of_row) >= 36);

    SyntheticOptions compact = farOptions();
    SyntheticAnchors anchors = farAnchors(compact);
    makeCompact(anchors, compact);
    const FarModel full(compact, anchors);
    compact.flags |= kModelCompact;
    const FarModel model(compact, anchors);
    CHECK(likeAll(model.view(), {farEye()}, detailed(2)) >= 36);
    const auto a = open(full.view()), b = open(model.view());
    CHECK(psnr(settled(*a, {farEye()}, detailed(2))[0], settled(*b, {farEye()}, detailed(2))[0]) >= 60);
}

TEST_CASE("coarse: levels that switch and levels that fade")
{
    const struct {
        LevelRule rule;
        float fade;
        double least_db; // half a decibel above what copies reach that do not fade
    } cases[] = {{LevelRule::Round, 0, 37}, {LevelRule::Round, 0.8f, 38.1}, {LevelRule::Progressive, 0, 38.4}};
    for (const auto& of : cases) {
        CAPTURE(uint32_t(of.rule));
        CAPTURE(of.fade);
        FarModel model(withLevels(of.rule, 1500)); // few, so that what fades is seen through
        reachTheFar(model);
        FrameOptions options = detailed(2);
        options.lod_fade = of.fade;
        CHECK(likeAll(model.view(), {farEye()}, options) >= of.least_db);
    }
}

TEST_CASE("coarse: two eyes that share their bins and two that do not; none is made of what they see too differently")
{
    const FarModel model;
    FrameOptions merged = mergedEyes(detailed(2));
    const std::vector<EyeParams> toed = {farEye(0, 0.5f), farEye(0.3f, 0.2f, 80, 64)};
    CHECK(likeAll(model.view(), farPair(), detailed(2)) >= 36);
    CHECK(likeAll(model.view(), farPair(), merged) >= 36);
    CHECK(likeAll(model.view(), toed, detailed(2)) >= 36);
    const auto gpu = open(model.view());
    const std::vector<EyeParams> wide = farPair(-1, 2.2f);
    const auto now = settled(*gpu, wide, detailed(2)), all = render(*gpu, wide, detailed(0));
    CHECK(now[0].result.coarse.kept == 0);
    for (size_t e = 0; e < 2; ++e)
        CHECK(sameBytes(now[e].pixels, all[e].pixels));
}

TEST_CASE("coarse: copies of another appearance, resolution, detail, level bias or fade are made anew")
{
    SUBCASE("appearance")
    {
        const FarModel model(withRows(2500));
        Asked before, after;
        before.options.appearance = 0;
        after.options.appearance = 2;
        checkForgets(model.view(), before, after, true);
        const auto gpu = open(model.view());
        const auto made = [&](int32_t row) {
            after.options.appearance = row;
            return render(*gpu, after.eyes, after.options)[0].result.coarse.made;
        };
        CHECK(made(0) > 0);
        for (const int32_t row : {1, 2, 0})
            CHECK((made(row) > 0) == kBackend.makes_all); // each forgets, and there is nothing to forget but once
        CHECK((made(0) > 0) != kBackend.makes_all);
        const auto fresh = open(model.view());
        CHECK(sameBytes(settled(*gpu, after.eyes, after.options)[0].pixels,
                        settled(*fresh, after.eyes, after.options)[0].pixels));
    }
    SUBCASE("resolution and detail")
    {
        const FarModel model(farOptions(3000));
        for (const bool finer : {false, true}) {
            CAPTURE(finer);
            Asked fine, coarse, high;
            coarse.options.detail = high.options.detail = 4;
            high.eyes = {farEye(0, 0, 2 * kFarWidth, 2 * kFarHeight)};
            checkForgets(model.view(), finer ? coarse : high, finer ? high : coarse, finer);
            checkForgets(model.view(), finer ? coarse : fine, finer ? fine : coarse, finer);
        }
    }
    SUBCASE("level bias and fade")
    {
        FarModel model(withLevels(LevelRule::Round, 2000));
        reachTheFar(model);
        Asked plain, finer, fading;
        finer.options.lod_bias = 0.6f;
        fading.options.lod_fade = 0.8f;
        checkForgets(model.view(), plain, finer, true);
        checkForgets(model.view(), finer, plain);
        checkForgets(model.view(), plain, fading);
    }
}

TEST_CASE("coarse: bands of columns are those of the whole picture")
{
    const FarModel model;
    const auto whole = open(model.view());
    uint64_t fewer = 0;
    for (const bool pair : {false, true}) {
        const std::vector<EyeParams> eyes = pair ? farPair() : std::vector<EyeParams>{farEye()};
        const auto want = settled(*whole, eyes, detailed(2)), all = render(*whole, eyes, detailed(0));
        for (const ColumnRange& band : {ColumnRange{0, 32}, ColumnRange{32, 64}, ColumnRange{64, kFarWidth}}) {
            CAPTURE(band.first);
            const auto own = open(model.view());
            FrameOptions options = detailed(2);
            options.columns = band;
            const auto now = settled(*own, eyes, options);
            fewer += groupsOf(want[0].result.coarse) - groupsOf(now[0].result.coarse);
            for (size_t e = 0; e < eyes.size(); ++e) {
                const auto got = columnsOf(now[e].pixels, kFarWidth, band);
                CHECK(compare(got, columnsOf(want[e].pixels, kFarWidth, band)).psnr >=
                      70); // a copy reaches some further
                CHECK(compare(got, columnsOf(all[e].pixels, kFarWidth, band)).psnr >= 35);
            }
        }
    }
    CHECK(fewer > 0); // each looks at little beside what it shows
}

TEST_CASE("coarse: 100 km away as near the picture of all Gaussians as at the origin")
{
    SyntheticOptions options = farOptions(6000);
    options.log_scale = -2.4f;
    const FarModel model(options);
    int32_t cells[3];
    farCells(model.view(), cells);
    const MovedModel far(model.view(), cells);
    const LocalModel local(far.view(), localOrigin(far.view()).value());
    const Camera camera = cameraAt(0.4f, -kFarAway, 240, 180);
    const double here = likeAll(model.view(), {eyeParams(camera, {})}, detailed(2)),
                 there = likeAll(local.view(), {eyeParams(movedCamera(camera, far.by()), local.view().origin)},
                                 detailed(2));
    CHECK(here >= 36);
    CHECK(there >= here - 1.5); // the grid of cells lies elsewhere
}

TEST_CASE("coarse: depths are near those of all Gaussians")
{
    const FarModel model;
    const auto gpu = open(model.view());
    const std::vector<EyeParams> eyes = farPair();
    std::vector<std::vector<float>> pictures;
    const auto all = renderDepths(*gpu, eyes, detailed(0), pictures);
    const auto want = settled(*gpu, eyes, detailed(2));
    const auto now = renderDepths(*gpu, eyes, detailed(2), pictures);
    for (size_t e = 0; e < 2; ++e) {
        CHECK(sameBytes(pictures[e], want[e].pixels));
        size_t finite = 0, others = 0;
        for (size_t i = 0; i < now[e].size(); ++i) {
            CHECK(now[e][i] > 0.0f);
            finite += std::isfinite(all[e][i]);
            others += std::isfinite(now[e][i]) != std::isfinite(all[e][i]);
        }
        tell(finite, " finite, ", others, " others, ", otherDepths(now[e], all[e], 0.01), " another");
        CHECK(finite > now[e].size() / 4);
        CHECK(others < now[e].size() / 50);
        CHECK(otherDepths(now[e], all[e], 0.03) < 0.02); // the plate is three hundredths deep
    }
}

TEST_CASE("coarse: every input of the networks, other rules and positions, and slots that are masked")
{
    SyntheticOptions shape{.appearance_dim = 8,
                           .appearance_rows = 3,
                           .raster_rules = RasterRules::Gsplat,
                           .encoding = PositionEncoding::Float};
    shape.flags |= kModelFeatureBank | kModelBankDistance | kModelMaskedSlots;
    shape.inputs = kMlpTakesDistance | kMlpTakesAppearance;
    shape.n_offsets = 5;
    const auto model = coarseModel(shape);
    const auto coarse = open(model->view()), plain = open(model->view());
    FrameOptions options = detailed(2);
    options.appearance = 1;
    for (int i = 0; i < 5; ++i) {
        CAPTURE(i);
        CoarseCounts counts;
        CHECK(detailLoss(*coarse, *plain, farWalk(i), options, &counts) > 34);
        CHECK(coarseGroups(counts) > 0);
        CHECK((counts.kept > 0) == (i > 0));
    }
}

// Copies grow old by a frame each, whatever the frame shows, and are new where they are made anew.
TEST_CASE("coarse: the view of ages shows frames since a copy was made")
{
    const auto model = coarseModel();
    const auto renderer = open(model->view());
    const uint32_t frames = kBackend.makes_all ? 1 : 3; // by when all are made, at most
    const float slack = kBackend.makes_all ? 1e-4f : 5e-3f;
    FrameOptions options = over(0.0f, detailed(kMostDetail));
    for (uint32_t i = 0; i < 4; ++i) {
        CAPTURE(i);
        options.view = i == 2 ? FrameView::Picture : FrameView::Age;
        const auto images = render(*renderer, farWalk(0), options);
        CHECK((images[0].result.coarse.made > 0) == (i < frames));
        if (options.view == FrameView::Picture)
            continue;
        const auto [least, most] = agesShown(images, slack);
        CHECK(least == doctest::Approx(ageColour(i < frames ? 0 : i - frames + 1).g).epsilon(slack));
        CHECK(most == doctest::Approx(ageColour(i).g).epsilon(slack));
    }
    CHECK(agesShown(render(*renderer, farWalk(0, 2, 30), options), slack).first < slack);
}
