// SPDX-License-Identifier: Apache-2.0
// Scores of pictures on a GPU against those of the host's scorer.
#include "kernels/metrics/square_sums.h"
#include "runtime/devices/device_scorer.h"
#include "tests/kernels/gpu_buffers.h"
#include "tests/kernels/gpu_tools.h"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <random>

using namespace gsc;
using namespace gsc::test;

namespace {

using Pixels = std::vector<float>;

Pixels noise(uint32_t seed, uint32_t width, uint32_t height)
{
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> value(-0.1f, 1.1f); // pictures may lie outside [0, 1]
    Pixels pixels(size_t(width) * height * 3);
    for (float& pixel : pixels)
        pixel = value(random);
    return pixels;
}

// Adds errors to a picture, larger ones in its right half.
Pixels disturbed(Pixels pixels, uint32_t seed, uint32_t width, float by)
{
    std::mt19937 random(seed);
    std::normal_distribution<float> error(0, by);
    for (size_t i = 0; i < pixels.size(); ++i)
        pixels[i] += error(random) * (i / 3 % width > width / 2 ? 3.0f : 1.0f);
    return pixels;
}

EyeGaze gazeAt(float x, uint32_t width, uint32_t height)
{
    EyeGaze gaze;
    gaze.eye.width = width;
    gaze.eye.height = height;
    gaze.eye.focal_x = gaze.eye.focal_y = float(width);
    gaze.x = x;
    return gaze;
}

void checkClose(const std::optional<double>& a, const std::optional<double>& b)
{
    REQUIRE(a.has_value() == b.has_value());
    if (!a)
        return;
    REQUIRE(std::isnan(*a) == std::isnan(*b));
    if (std::isfinite(*b))
        CHECK(std::abs(*a - *b) <
              1e-7); // 1e-5 is asked for; last bits of powers and roots and the order of sums differ
    else if (!std::isnan(*b))
        CHECK(*a == *b);
}

void checkSame(const PictureScores& gpu, const PictureScores& host, double pixels)
{
    if (std::isfinite(host.psnr))
        CHECK(std::abs(gpu.psnr - host.psnr) < 1e-6); // dB; 0.001 is asked for
    else
        CHECK(gpu.psnr == host.psnr);
    CHECK(gpu.max_error == host.max_error);
    CHECK(gpu.over_1_255 == host.over_1_255);
    checkClose(gpu.change, host.change);
    checkClose(gpu.motion, host.motion);
    checkClose(gpu.pop, host.pop);
    checkClose(gpu.error_pop, host.error_pop);
    checkClose(gpu.ssim, host.ssim);
    checkClose(gpu.flip, host.flip);
    for (size_t part = 0; part < 2; ++part) {
        const FoveaSums &a = gpu.fovea[part], &b = host.fovea[part];
        CHECK(a.pixels == b.pixels);
        if (std::isfinite(b.squares))
            CHECK(a.squares == doctest::Approx(b.squares).epsilon(1e-12));
        else
            CHECK(a.squares == b.squares);
        REQUIRE(a.flip.has_value() == b.flip.has_value());
        if (b.flip && std::isfinite(*b.flip))
            CHECK(std::abs(*a.flip - *b.flip) < 1e-7 * pixels);
    }
}

struct Scorers {
    std::unique_ptr<PictureScorer> gpu = makeDeviceScorer(cudaRenderer()), host = makeHostScorer();

    // `on_device`: of the image; the exact one stays in this process where it is false.
    void check(uint32_t eye, const Pixels& image, const Pixels& exact, uint32_t width, uint32_t height,
               const ScoreRequest& request, bool on_device = true)
    {
        REQUIRE(gpu);
        const GuardedBuffer<float> a(image), b(exact);
        const PictureRef device_image{a.get(), width, height, true}, device_exact{b.get(), width, height, true};
        const PictureRef host_image{image.data(), width, height}, host_exact{exact.data(), width, height};
        const PictureScores of_gpu =
            gpu->score(eye, on_device ? device_image : host_image, on_device ? device_exact : host_exact, request);
        checkSame(of_gpu, host->score(eye, host_image, host_exact, request), double(width) * height);
        CHECK(a.read() == image); // pictures are read only; NaN compares unlike, so it is not in these
        CHECK(a.intact());
        CHECK(b.intact());
    }
};

} // namespace

TEST_CASE("scores: of pictures of every size, with and without a gaze, SSIM and FLIP")
{
    for (const auto& [width, height] :
         {std::pair<uint32_t, uint32_t>{1, 1}, {3, 40}, {16, 16}, {33, 17}, {64, 5}, {47, 48}}) {
        CAPTURE(width);
        CAPTURE(height);
        Scorers scorers;
        for (const float by : {0.0f, 1e-5f, 0.01f, 0.3f}) {
            const Pixels exact = noise(7, width, height), image = disturbed(exact, 8, width, by);
            const EyeGaze gaze = gazeAt(0.2f, width, height);
            scorers.check(0, image, exact, width, height, {});
            scorers.check(0, image, exact, width, height, {true, true, nullptr});
            scorers.check(1, image, exact, width, height, {false, true, &gaze});
            scorers.check(1, image, exact, width, height, {true, false, &gaze}, false);
        }
    }
}

TEST_CASE("scores: from picture to picture, of two eyes, across a change of size and where the next follows none")
{
    Scorers scorers;
    uint32_t seed = 1;
    const auto play = [&](uint32_t width, uint32_t height, int pictures) {
        for (int i = 0; i < pictures; ++i)
            for (uint32_t eye = 0; eye < 2; ++eye, ++seed) {
                const Pixels exact = noise(seed, width, height);
                scorers.check(eye, disturbed(exact, 100 + seed, width, 0.02f * float(i % 3)), exact, width, height,
                              {seed > 8, seed > 4, nullptr});
            }
    };
    play(40, 24, 6);
    play(24, 40, 5); // as many pixels
    scorers.gpu->forget();
    scorers.host->forget();
    play(24, 40, 5);
    play(64, 48, 2);
}

TEST_CASE("scores: a pixel that is no number is as bad on a GPU")
{
    constexpr float kNaN = std::numeric_limits<float>::quiet_NaN(), kInfinity = std::numeric_limits<float>::infinity();
    for (const float bad : {kNaN, kInfinity, -kInfinity}) {
        CAPTURE(bad);
        const auto gpu = makeDeviceScorer(cudaRenderer()), host = makeHostScorer();
        for (int i = 0; i < 5; ++i) {
            const Pixels exact = noise(3, 20, 20);
            Pixels image = exact;
            if (i % 2 == 1)
                image[500] = bad;
            const EyeGaze gaze = gazeAt(0, 20, 20);
            const PictureRef a{image.data(), 20, 20}, b{exact.data(), 20, 20};
            checkSame(gpu->score(0, a, b, {true, true, &gaze}), host->score(0, a, b, {true, true, &gaze}), 400);
        }
    }
}
