// SPDX-License-Identifier: Apache-2.0
// Measures of the difference of two images. Images are height x width x 3 floats, interleaved RGB, nominally in [0,
// 1].
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace gsc {

struct ImageView {
    const float* pixels = nullptr;
    uint32_t width = 0, height = 0;
};

struct ImageDifference {
    double mse = 0; // mean squared error over pixels and channels
    double psnr = 0;
    double max_error = 0; // largest |a - b| of any channel
    uint32_t max_x = 0, max_y = 0;
    uint64_t over_1_255 = 0; // number of pixels with a channel that differs by more than 1/255
};

double psnrOf(double mse); // PSNR of a mean squared error: 10 log10(1 / mse), in dB; +inf for 0

// The functions below have the precondition that both images have equal sizes.
ImageDifference compareImages(const ImageView& a, const ImageView& b);

// Structural similarity with an 11x11 Gaussian window of sigma 1.5, mean over pixels and channels (Wang et al. 2004).
// Pixels outside the image count as 0, as in the trainers' own metric, so that the numbers compare with their reports.
double ssim(const ImageView& a, const ImageView& b);

// FLIP paper's default: seen from 0.7 m, a display 0.7 m and 3840 pixels wide
constexpr double kFlipPixelsPerDegree = 67.02;

// LDR-FLIP (Andersson et al. 2020), mean over pixels. `map`, if not null, receives the error of each pixel.
double flip(const ImageView& reference, const ImageView& test, double pixels_per_degree = kFlipPixelsPerDegree,
            std::span<float> map = {});

// Differences over several frames: PSNR of the mean squared error of all, PSNR of the worst frame, largest error.
struct PooledDifference {
    double mse_sum = 0;
    uint64_t frames = 0;
    double worst_psnr = 0; // PSNR of the worst frame in dB; valid if frames > 0
    uint64_t worst_frame = 0;
    double max_error = 0;

    void add(const ImageDifference& difference);
    [[nodiscard]] double psnr() const;
};

} // namespace gsc
