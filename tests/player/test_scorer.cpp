// SPDX-License-Identifier: Apache-2.0
// Scores of a run against values worked out by hand.
#include "player/measure/scorer.h"
#include "runtime/records/run_row.h"

#include <doctest/doctest.h>
#include <nlohmann/json.hpp>

#include <cmath>
#include <limits>
#include <vector>

using namespace gsc;

namespace {

// 2 x 1 pixels, all six values the same.
struct Flat {
    explicit Flat(float value, uint32_t image_width = 2) : pixels(3 * size_t(image_width), value), width(image_width) {}
    [[nodiscard]] PictureRef view() const { return {pixels.data(), width, 1}; }
    std::vector<float> pixels;
    uint32_t width;
};

// One eye; frame i of the run is `run[i]` everywhere, of the exact path `exact[i]`.
Accuracy scoreFlat(const std::vector<float>& run, const std::vector<float>& exact, ScoreOptions options = {})
{
    Scorer scorer(options);
    for (size_t i = 0; i < run.size(); ++i)
        scorer.add(i, 0, Flat(run[i]).view(), Flat(exact[i]).view());
    return scorer.result();
}

constexpr double kInfinity = std::numeric_limits<double>::infinity();

} // namespace

TEST_CASE("pooled, worst and first percentile")
{
    const Accuracy a = scoreFlat({0.5f, 0.6f, 0.51f}, {0.5f, 0.5f, 0.5f}); // errors 0, 0.1, 0.01
    CHECK(a.images == 3);
    CHECK(a.psnr_pooled == doctest::Approx(-10 * std::log10((0.01 + 0.0001) / 3)).epsilon(1e-5));
    CHECK(a.psnr_min == doctest::Approx(20).epsilon(1e-5));
    CHECK(a.psnr_min_frame == 1);
    CHECK(a.psnr_p1 == a.psnr_min); // nearest rank of three values
    CHECK(a.max_error == doctest::Approx(0.1).epsilon(1e-5));
    CHECK(a.over_1_255 == 4); // both pixels of two images
    REQUIRE(a.frame_psnr.size() == 3);
    CHECK(a.frame_psnr[0] == kInfinity);
    CHECK(a.frame_psnr[2] == doctest::Approx(40).epsilon(1e-5));
    CHECK(a.ssim.frames == 0);
    CHECK(a.flip.frames == 0);
}

TEST_CASE("the first percentile of 200 images is the second worst")
{
    std::vector<float> run(200, 0.501f);
    run[7] = 0.6f;
    run[130] = 0.55f;
    run[131] = 0.52f;
    const Accuracy a = scoreFlat(run, std::vector<float>(200, 0.5f));
    CHECK(a.psnr_min == doctest::Approx(20).epsilon(1e-5));
    CHECK(a.psnr_p1 == doctest::Approx(-20 * std::log10(0.05)).epsilon(1e-5));
}

TEST_CASE("temporal error is the change of the error, not of the picture")
{
    // errors 0.1, 0.1, 0.3, 0: changes 0, 0.2, 0.3 while the exact path moves by much more
    const Accuracy a = scoreFlat({0.1f, 0.6f, 1.2f, 0.2f}, {0.0f, 0.5f, 0.9f, 0.2f});
    REQUIRE(a.temporal.images == 3);
    CHECK(a.temporal.rms == doctest::Approx(std::sqrt((0.04 + 0.09) / 3)).epsilon(1e-5));
    CHECK(a.temporal.p50 == doctest::Approx(0.2).epsilon(1e-5));
    CHECK(a.temporal.p99 == doctest::Approx(0.3).epsilon(1e-5));
    CHECK(a.temporal.max == doctest::Approx(0.3).epsilon(1e-5));
    CHECK(a.temporal.max_frame == 3);
    REQUIRE(a.frame_temporal.size() == 4);
    CHECK(std::isnan(a.frame_temporal[0]));
    CHECK(a.frame_temporal[1] == doctest::Approx(0).epsilon(1e-6));
}

TEST_CASE("percentiles of a hundred changes")
{
    std::vector<float> run = {0.5f};
    for (int i = 1; i <= 100; ++i) // to and fro by 0.001, 0.002, ...
        run.push_back(run.back() + (i % 2 ? 0.001f : -0.001f) * float(i));
    const Accuracy a = scoreFlat(run, std::vector<float>(run.size(), 0.5f));
    REQUIRE(a.motion.images == 100);
    CHECK(a.motion.p50 == doctest::Approx(0.05).epsilon(1e-3));
    CHECK(a.motion.p90 == doctest::Approx(0.09).epsilon(1e-3));
    CHECK(a.motion.p99 == doctest::Approx(0.099).epsilon(1e-3));
    CHECK(a.motion.max == doctest::Approx(0.1).epsilon(1e-3));
    CHECK(a.temporal.p50 == doctest::Approx(0.05).epsilon(1e-3));
    CHECK(a.temporal.p99 == doctest::Approx(0.099).epsilon(1e-3));
}

TEST_CASE("a change in one of six values")
{
    Scorer scorer({});
    const Flat exact(0.5f);
    Flat run(0.5f);
    scorer.add(0, 0, run.view(), exact.view());
    run.pixels[4] = 0.9f;
    scorer.add(1, 0, run.view(), exact.view());
    CHECK(scorer.result().temporal.max == doctest::Approx(0.4 / std::sqrt(6)).epsilon(1e-5));
}

TEST_CASE("two eyes: each is an image, a frame is its worse one")
{
    Scorer scorer({{}, 1, 1});
    const Flat exact(0.5f);
    const float left[] = {0.6f, 0.5f}, right[] = {0.51f, 0.7f};
    for (uint64_t frame = 0; frame < 2; ++frame) {
        scorer.add(frame, 0, Flat(left[frame]).view(), exact.view());
        scorer.add(frame, 1, Flat(right[frame]).view(), exact.view());
    }
    const Accuracy a = scorer.result();
    CHECK(a.images == 4);
    CHECK(a.frame_psnr.size() == 2);
    CHECK(a.frame_psnr[0] == doctest::Approx(20).epsilon(1e-5));
    CHECK(a.frame_psnr[1] == doctest::Approx(-20 * std::log10(0.2)).epsilon(1e-5));
    CHECK(a.temporal.images == 2);
    CHECK(a.frame_temporal[1] == doctest::Approx(0.19).epsilon(1e-5));
    CHECK(a.ssim.frames == 2);
    CHECK(a.flip.frames == 2);
    CHECK(a.flip.worst >= a.flip.mean);
    CHECK(a.ssim.worst <= a.ssim.mean);
    CHECK(a.ssim.mean < 1);
    CHECK(a.flip.mean > 0);
}

TEST_CASE("every nth frame, frames of another size, nothing at all")
{
    const std::vector<float> flat(7, 0.5f);
    const Accuracy sampled = scoreFlat(flat, flat, {{}, 3, 5});
    CHECK(sampled.ssim.frames == 3); // 0, 3, 6
    CHECK(sampled.flip.frames == 2); // 0, 5
    CHECK(sampled.ssim.mean == doctest::Approx(1));
    CHECK(sampled.flip.mean == 0);

    Scorer scorer({});
    for (uint64_t frame = 0; frame < 3; ++frame)
        scorer.add(frame, 0, Flat(0.5f, uint32_t(2 + frame)).view(), Flat(0.4f, uint32_t(2 + frame)).view());
    CHECK(scorer.result().temporal.images == 0);
    CHECK(toJson(scorer.result())["temporal"].is_null());
    CHECK(Scorer({}).result().images == 0);
}

TEST_CASE("equal is null, not finite is as bad as can be")
{
    const nlohmann::ordered_json equal = toJson(scoreFlat({0.5f, 0.5f}, {0.5f, 0.5f}));
    CHECK(equal["psnr"]["pooled"].is_null());
    CHECK(equal["psnr"]["min"].is_null());
    CHECK(equal["temporal"]["max"] == 0);
    CHECK(equal["ssim"].is_null());
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const nlohmann::ordered_json broken = toJson(scoreFlat({0.5f, nan, 0.5f}, {0.5f, 0.5f, 0.5f}, {{}, 1, 1}));
    CHECK(broken["psnr"]["pooled"] == -999);
    CHECK(broken["psnr"]["min_frame"] == 1);
    CHECK(broken["max_error"] == 1e30);
    CHECK(broken["temporal"]["max"] == 1e30);
    CHECK(broken["ssim"]["mean"] == 0);
    CHECK(broken["flip"]["max"] > 0.1);
    CHECK(broken["over_1_255"] == 2);
}

TEST_CASE("motion is the change of the picture, a pop what one square changes at once")
{
    // 40 x 20 pixels: 3 x 2 squares, those at the edges smaller. All get 0.01 lighter per frame; in frame 4 the square
    // in the lower right corner, 8 x 4 pixels, jumps by 0.2 and stays.
    Scorer scorer({});
    for (uint64_t frame = 0; frame < 8; ++frame) {
        std::vector<float> pixels(40 * 20 * 3, 0.01f * float(frame));
        for (size_t y = 16; frame >= 4 && y < 20; ++y)
            for (size_t x = 32 * 3; x < 40 * 3; ++x)
                pixels[y * 40 * 3 + x] += 0.2f;
        const PictureRef image{pixels.data(), 40, 20};
        scorer.add(frame, 0, image, image);
    }
    const Accuracy a = scorer.result();
    CHECK(a.motion.images == 7);
    CHECK(a.motion.p50 == doctest::Approx(0.01).epsilon(1e-4));
    const double jump = (768 * 0.01 * 0.01 + 32 * 0.21 * 0.21) / 800;
    CHECK(a.motion.max == doctest::Approx(std::sqrt(jump)).epsilon(1e-4));
    CHECK(a.motion.max_frame == 4);
    CHECK(a.pop.images == 5); // frames 2 to 6
    CHECK(a.pop.p50 == doctest::Approx(0).epsilon(1e-5));
    CHECK(a.pop.max == doctest::Approx(0.2).epsilon(1e-4));
    CHECK(a.pop.max_frame == 4);
}

TEST_CASE("a pop in the last of whole squares is seen, and in no other")
{
    Scorer scorer({});
    for (uint64_t frame = 0; frame < 8; ++frame) { // 2 x 1 squares
        std::vector<float> pixels(32 * 16 * 3, 0.5f);
        for (size_t y = 0; frame >= 4 && y < 16; ++y)
            std::fill_n(pixels.begin() + std::ptrdiff_t((y * 32 + 16) * 3), 16 * 3, 0.75f);
        const PictureRef image{pixels.data(), 32, 16};
        scorer.add(frame, 0, image, image);
    }
    CHECK(scorer.result().pop.max == doctest::Approx(0.25).epsilon(1e-4));
}

TEST_CASE("a pop of the error is that of a square which the exact pictures do not have")
{
    Scorer scorer({});
    for (uint64_t frame = 0; frame < 8; ++frame) { // 2 x 1 squares: both pictures jump on the left, one on the right
        std::vector<float> pixels(32 * 16 * 3, frame >= 3 ? 0.75f : 0.25f), exact = pixels;
        for (size_t y = 0; frame >= 5 && y < 16; ++y)
            std::fill_n(pixels.begin() + std::ptrdiff_t((y * 32 + 16) * 3), 16 * 3, 0.875f);
        scorer.add(frame, 0, {pixels.data(), 32, 16}, {exact.data(), 32, 16});
    }
    const Accuracy a = scorer.result();
    CHECK(a.pop.max == doctest::Approx(0.5).epsilon(1e-4));
    CHECK(a.error_pop.images == a.pop.images);
    CHECK(a.error_pop.max == doctest::Approx(0.125).epsilon(1e-4));
    CHECK(a.error_pop.max_frame == 5);
    CHECK(a.error_pop.p90 == doctest::Approx(0.125).epsilon(1e-4)); // percentile over frames 2 to 6
    CHECK(a.error_pop.p50 == doctest::Approx(0).epsilon(1e-5));
}

TEST_CASE("pops need four pictures of a size in a row, and a pixel that is no number is the worst of them")
{
    Scorer scorer({});
    uint64_t frame = 0;
    for (const uint32_t width : {2u, 2u, 2u, 3u, 3u, 3u})
        scorer.add(frame++, 0, Flat(0.5f, width).view(), Flat(0.5f, width).view());
    CHECK(scorer.result().motion.images == 4);
    CHECK(scorer.result().pop.images == 0);
    CHECK(toJson(scorer.result())["pop"].is_null());
    scorer.add(frame++, 0, Flat(0.5f, 3).view(), Flat(0.5f, 3).view());
    CHECK(scorer.result().pop.images == 1);
    scorer.add(frame++, 0, Flat(std::nanf(""), 3).view(), Flat(0.5f, 3).view());
    CHECK(toJson(scorer.result())["motion"]["max"] == 1e30);
    CHECK(toJson(scoreFlat({0.5f}, {0.5f}))["motion"].is_null());
}
