// SPDX-License-Identifier: Apache-2.0
// Foveation: what an eye looks at is drawn as without it, what lies around it with fewer Gaussians.
#include "kernels/math/foveation.h"
#include "tests/backends/false_colour_tools.h"
#include "tests/backends/far_scene.h"

#include <doctest/doctest.h>

#include <cmath>

using namespace gsc;
using namespace gsc::test;

namespace {

constexpr float kSmallest = 6; // pixels

FrameOptions foveated(float x = 0, float y = 0)
{
    FrameOptions options = onGrey(Tier::Fast);
    options.foveation.smallest = kSmallest;
    for (auto& gaze : options.foveation.gaze) {
        gaze[0] = x;
        gaze[1] = y;
    }
    return options;
}

// Largest difference of two pictures where the angle from a direction is below and above so many degrees.
struct Apart {
    double within = 0, beyond = 0;
};

template <typename Picture>
Apart apart(const EyeParams& eye, const Picture& a, const Picture& b, float x, float y, double degrees)
{
    Apart out;
    for (uint32_t row = 0; row < eye.height; ++row)
        for (uint32_t column = 0; column < eye.width; ++column) {
            const double u =
                (double(column) + 0.5 - double(eye.width) / 2) / double(eye.focal_x) + double(eye.tan_mid_x);
            const double v = (double(row) + 0.5 - double(eye.height) / 2) / double(eye.focal_y) + double(eye.tan_mid_y);
            const double cosine = (u * double(x) + v * double(y) + 1) /
                                  std::sqrt((u * u + v * v + 1) * (double(x) * double(x) + double(y) * double(y) + 1));
            const size_t at = (size_t(row) * eye.width + column) * 3;
            double off = 0;
            for (size_t c = 0; c < 3; ++c)
                off = std::max(off, std::abs(double(a.pixels[at + c]) - double(b.pixels[at + c])));
            double& most = cosine > std::cos(degrees * 3.14159265 / 180) ? out.within : out.beyond;
            most = std::max(most, off);
        }
    return out;
}

uint64_t drawn(const FrameResult& result)
{
    return result.eyes[0].gaussians_visible + result.eyes[1].gaussians_visible;
}

} // namespace

TEST_CASE("foveation: the finest variance grows with the square of the angle, from nothing to all")
{
    const auto at = [](double degrees) {
        return double(finestVariance(float(std::cos(degrees * 3.14159265 / 180)), 4));
    };
    CHECK(at(0) == 0);
    CHECK(at(11.9) == 0);
    CHECK(at(40.1) == doctest::Approx(4));
    CHECK(at(80) == doctest::Approx(4));
    CHECK(at(30) > 4 * 0.45);
    CHECK(at(30) < 4 * 0.6);
    double mean = 0;
    uint32_t below[4] = {};
    for (uint32_t i = 0; i < 40000; ++i) {
        const double rank = double(foveationRank(i));
        REQUIRE(rank >= 0);
        REQUIRE(rank < 1);
        mean += rank / 40000;
        ++below[size_t(rank * 4)];
    }
    CHECK(mean == doctest::Approx(0.5).epsilon(0.01));
    for (const uint32_t count : below)
        CHECK(count == doctest::Approx(10000).epsilon(0.05));
}

TEST_CASE(
    "foveation: the fovea is the picture without it, wherever the eyes look, and there are fewer Gaussians around it")
{
    const SyntheticModel model(modelOptions(LevelRule::None));
    const auto gpu = open(model.view());
    const auto eyes = viewEyes(0, 2);
    const auto plain = render(*gpu, eyes, onGrey(Tier::Fast));
    for (const float x : {0.0f, 0.4f}) {
        CAPTURE(x);
        const auto thin = render(*gpu, eyes, foveated(x, 0.1f));
        CHECK(drawn(thin[0].result) < drawn(plain[0].result));
        CHECK(drawn(thin[0].result) > 0);
        for (size_t e = 0; e < 2; ++e) {
            const Apart off = apart(eyes[e], plain[e], thin[e], x, 0.1f, 8);
            CHECK(off.within < 1e-3);
            CHECK(off.beyond > 0.02);
        }
    }
    // and nothing of it is left
    const auto again = render(*gpu, eyes, onGrey(Tier::Fast));
    for (size_t e = 0; e < 2; ++e)
        CHECK(again[e].pixels == plain[e].pixels);
}

TEST_CASE("foveation: the CPU draws everything; exact and what makes no sense are refused")
{
    const SyntheticModel model(modelOptions(LevelRule::None));
    const auto cpu = open(model.view(), "cpu");
    const auto eyes = viewEyes(0, 1);
    CHECK(render(*cpu, eyes, foveated())[0].pixels == render(*cpu, eyes, onGrey(Tier::Fast))[0].pixels);
    FrameOptions options = foveated();
    options.tier = Tier::Exact;
    CHECK_THROWS_AS(render(*cpu, eyes, options), Error);
    options = foveated(NAN);
    CHECK_THROWS_AS(render(*cpu, eyes, options), Error);
    options = foveated();
    options.foveation.smallest = -1;
    CHECK_THROWS_AS(render(*cpu, eyes, options), Error);
}

TEST_CASE("coarse: together with foveation, copies are coarser where no eye looks, and are made anew where one comes")
{
    const FarModel model;
    const auto gpu = open(model.view());
    const std::vector<EyeParams> eyes = {farEye()};
    const auto all = render(*gpu, eyes, detailed(0)), coarse = settled(*gpu, eyes, detailed(2));
    FrameOptions thin = detailed(0), both = detailed(2);
    for (FrameOptions* const options : {&thin, &both}) {
        options->foveation.smallest = 3;
        options->foveation.gaze[0][0] = 0.6f; // beside the picture
    }
    const auto thinned = render(*gpu, eyes, thin), now = settled(*gpu, eyes, both);
    tell(psnr(thinned[0], all[0]), " dB thinned, ", psnr(coarse[0], all[0]), " coarse, both ", psnr(now[0], all[0]));
    CHECK(now[0].result.eyes[0].gaussians_visible < 0.5 * double(coarse[0].result.eyes[0].gaussians_visible));
    CHECK(psnr(now[0], all[0]) >= psnr(thinned[0], all[0]) + 2); // chance makes noise, larger cells do not
    CHECK(psnr(now[0], all[0]) >= 29);
    both.foveation.gaze[0][0] = 0;
    const auto come = render(*gpu, eyes, both); // no copy is drawn that is too coarse by far
    tell(psnr(come[0], all[0]), " dB where a gaze has just come, made ", come[0].result.coarse.made);
    CHECK(come[0].result.coarse.made > 0);
    CHECK(psnr(come[0], all[0]) >= psnr(coarse[0], all[0]) - 1);
    CHECK(sameBytes(settled(*gpu, eyes, detailed(2))[0].pixels, coarse[0].pixels)); // nothing of it is kept
}
