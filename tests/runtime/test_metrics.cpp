// SPDX-License-Identifier: Apache-2.0
#include "runtime/metrics/metrics.h"
#include "tests/runtime/naive_flip.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

using namespace gsc;

namespace {

struct Picture {
    uint32_t width, height;
    std::vector<float> pixels;

    Picture(uint32_t w, uint32_t h, float value = 0) : width(w), height(h), pixels(size_t(w) * h * 3, value) {}
    Picture(uint32_t w, uint32_t h, float r, float g, float b) : Picture(w, h)
    {
        for (size_t i = 0; i < pixels.size(); i += 3) {
            pixels[i] = r;
            pixels[i + 1] = g;
            pixels[i + 2] = b;
        }
    }
    [[nodiscard]] ImageView view() const { return {pixels.data(), width, height}; }
};

// Smooth shapes with some noise, so that every step of a metric has work.
Picture scene(uint32_t width, uint32_t height, uint32_t seed)
{
    std::mt19937 random(seed);
    Picture picture(width, height);
    const double fx = 0.1 + double(random() % 100) / 300, fy = 0.1 + double(random() % 100) / 300;
    for (uint32_t y = 0; y < height; ++y)
        for (uint32_t x = 0; x < width; ++x)
            for (uint32_t c = 0; c < 3; ++c)
                picture.pixels[3 * (size_t(y) * width + x) + c] =
                    float(0.5 + 0.4 * std::sin(fx * x + c) * std::cos(fy * y - c) +
                          0.1 * (double(random()) / 4294967296.0 - 0.5));
    return picture;
}

Picture plusNoise(const Picture& picture, double amplitude, uint32_t seed)
{
    std::mt19937 random(seed);
    Picture out = picture;
    for (float& value : out.pixels)
        value += float(amplitude * (double(random()) / 4294967296.0 - 0.5));
    return out;
}

double naiveSsim(const ImageView& a, const ImageView& b)
{
    double window[11][11], total = 0;
    for (int i = 0; i < 11; ++i)
        for (int j = 0; j < 11; ++j)
            total += window[i][j] = std::exp(-((i - 5) * (i - 5) + (j - 5) * (j - 5)) / 4.5);
    double sum = 0;
    for (int c = 0; c < 3; ++c)
        for (int y = 0; y < int(a.height); ++y)
            for (int x = 0; x < int(a.width); ++x) {
                double ma = 0, mb = 0, aa = 0, bb = 0, ab = 0;
                for (int i = 0; i < 11; ++i)
                    for (int j = 0; j < 11; ++j) {
                        const int u = x + j - 5, v = y + i - 5;
                        if (u < 0 || v < 0 || u >= int(a.width) || v >= int(a.height))
                            continue;
                        const double w = window[i][j] / total;
                        const double p = double(a.pixels[3 * (v * int(a.width) + u) + c]);
                        const double q = double(b.pixels[3 * (v * int(a.width) + u) + c]);
                        ma += w * p;
                        mb += w * q;
                        aa += w * p * p;
                        bb += w * q * q;
                        ab += w * p * q;
                    }
                sum += (2 * ma * mb + 1e-4) * (2 * (ab - ma * mb) + 9e-4) /
                       ((ma * ma + mb * mb + 1e-4) * (aa - ma * ma + bb - mb * mb + 9e-4));
            }
    return sum / (3.0 * a.width * a.height);
}

} // namespace

TEST_CASE("PSNR of known differences")
{
    const Picture black(8, 4), grey(8, 4, 0.1f);
    const ImageDifference same = compareImages(black.view(), black.view());
    CHECK(same.mse == 0);
    CHECK(same.psnr == std::numeric_limits<double>::infinity());
    CHECK(same.over_1_255 == 0);

    const ImageDifference tenth = compareImages(black.view(), grey.view());
    CHECK(tenth.psnr == doctest::Approx(20)); // 10 log10(1 / 0.01)
    CHECK(tenth.max_error == doctest::Approx(0.1));
    CHECK(tenth.over_1_255 == 32);

    Picture spot = black;
    spot.pixels[3 * (2 * 8 + 5) + 1] = -0.5f;
    const ImageDifference one = compareImages(black.view(), spot.view());
    CHECK(one.mse == doctest::Approx(0.25 / 96));
    CHECK(one.max_x == 5);
    CHECK(one.max_y == 2);
    CHECK(one.over_1_255 == 1);
}

TEST_CASE("a NaN is never an equal pixel")
{
    Picture black(4, 4), bad(4, 4);
    bad.pixels[7] = std::numeric_limits<float>::quiet_NaN();
    const ImageDifference difference = compareImages(black.view(), bad.view());
    CHECK(difference.max_error == std::numeric_limits<double>::infinity());
    CHECK(difference.psnr == -std::numeric_limits<double>::infinity());
    CHECK(difference.over_1_255 == 1);
}

TEST_CASE("pooled PSNR is that of the mean square error, not the mean of PSNRs")
{
    const Picture black(4, 4), a(4, 4, 0.1f), b(4, 4, 0.01f);
    PooledDifference pooled;
    pooled.add(compareImages(black.view(), b.view()));
    pooled.add(compareImages(black.view(), a.view()));
    pooled.add(compareImages(black.view(), black.view()));
    CHECK(pooled.frames == 3);
    CHECK(pooled.psnr() == doctest::Approx(-10 * std::log10((0.01 + 0.0001) / 3)));
    CHECK(pooled.worst_psnr == doctest::Approx(20));
    CHECK(pooled.worst_frame == 1);
    CHECK(pooled.max_error == doctest::Approx(0.1));
    CHECK(PooledDifference().psnr() == std::numeric_limits<double>::infinity()); // no pixel, no difference
}

TEST_CASE("SSIM equals its definition")
{
    const Picture a = scene(37, 23, 1), b = plusNoise(a, 0.3, 2);
    CHECK(ssim(a.view(), a.view()) == doctest::Approx(1));
    CHECK(ssim(a.view(), b.view()) == doctest::Approx(naiveSsim(a.view(), b.view())).epsilon(1e-4));
    CHECK(ssim(a.view(), b.view()) == doctest::Approx(ssim(b.view(), a.view())));
    CHECK(ssim(a.view(), plusNoise(a, 0.6, 2).view()) < ssim(a.view(), b.view()));

    // flat images: the structure term is 1, the luminance term (2 p q + c1) / (p^2 + q^2 + c1); borders differ
    const Picture p(64, 64, 0.2f), q(64, 64, 0.6f);
    CHECK(ssim(p.view(), q.view()) == doctest::Approx(naiveSsim(p.view(), q.view())).epsilon(1e-4));
    const Picture tiny(1, 1, 0.5f);
    CHECK(ssim(tiny.view(), tiny.view()) == doctest::Approx(1));
}

TEST_CASE("FLIP equals a naive evaluation of the paper's equations at every pixel")
{
    const Picture a = scene(31, 27, 3), b = plusNoise(scene(31, 27, 3), 0.4, 4), other = scene(31, 27, 9);
    Picture dark = a, darker = a; // where lightness is linear in luminance
    for (size_t i = 0; i < a.pixels.size(); ++i) {
        dark.pixels[i] = 0.05f * a.pixels[i];
        darker.pixels[i] = 0;
    }
    for (const auto& [first, test] :
         {std::pair<const Picture*, const Picture*>{&a, &b}, {&a, &other}, {&dark, &darker}}) {
        std::vector<float> map(size_t(31) * 27);
        const double mean = flip(first->view(), test->view(), 67.02, map);
        const std::vector<double> naive = test::naiveFlip(first->view(), test->view(), 67.02);
        double sum = 0, worst = 0;
        for (size_t i = 0; i < map.size(); ++i) {
            worst = std::max(worst, std::abs(double(map[i]) - naive[i]));
            sum += naive[i];
        }
        CHECK(worst < 2e-4); // planes are kept in float
        CHECK(mean == doctest::Approx(sum / double(map.size())).epsilon(1e-4));
        CHECK(mean > 0.05);
    }
}

TEST_CASE("FLIP of flat colours")
{
    const Picture black(40, 30), white(40, 30, 1.0f);
    CHECK(flip(white.view(), white.view()) == doctest::Approx(0));
    // no feature differs, so the error is the redistributed colour difference: HyAB 100 of at most 203.4
    CHECK(flip(black.view(), white.view()) == doctest::Approx(0.967).epsilon(2e-3));
    CHECK(flip(black.view(), white.view()) == doctest::Approx(flip(white.view(), black.view())));
    const Picture green(40, 30, 0, 1, 0), blue(40, 30, 0, 0, 1);
    CHECK(flip(green.view(), blue.view()) == doctest::Approx(1)); // the largest difference there is
    // values outside the display's range are clamped
    CHECK(flip(white.view(), Picture(40, 30, 2.0f).view()) == doctest::Approx(0));
}

TEST_CASE("FLIP grows with the error and shrinks with distance")
{
    const Picture a = scene(64, 48, 5);
    double last = 0;
    for (const double amplitude : {0.02, 0.1, 0.3, 0.8}) {
        const double error = flip(a.view(), plusNoise(a, amplitude, 6).view());
        CHECK(error > last);
        CHECK(error <= 1);
        last = error;
    }
    const Picture noisy = plusNoise(a, 0.3, 6);
    CHECK(flip(a.view(), noisy.view(), 120) < flip(a.view(), noisy.view(), 30));
}
