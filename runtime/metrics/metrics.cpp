// SPDX-License-Identifier: Apache-2.0
#include "runtime/metrics/metrics.h"

#include "kernels/metrics/ssim_rules.h"
#include "runtime/metrics/convolve.h"
#include "runtime/metrics/filter_weights.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace gsc {

double psnrOf(double mse)
{
    return mse > 0 ? -10 * std::log10(mse) : std::numeric_limits<double>::infinity();
}

ImageDifference compareImages(const ImageView& a, const ImageView& b)
{
    ImageDifference result;
    const size_t pixels = size_t(a.width) * a.height;
    double sum = 0;
    for (size_t i = 0; i < pixels; ++i) {
        double worst = 0;
        for (size_t c = 0; c < 3; ++c) {
            double error = std::abs(double(a.pixels[3 * i + c]) - double(b.pixels[3 * i + c]));
            // a NaN counts as the largest error, so that it is never overlooked
            if (std::isnan(error))
                error = std::numeric_limits<double>::infinity();
            sum += error * error;
            worst = std::max(worst, error);
        }
        result.over_1_255 += worst > 1.0 / 255;
        if (worst > result.max_error) {
            result.max_error = worst;
            result.max_x = uint32_t(i % a.width);
            result.max_y = uint32_t(i / a.width);
        }
    }
    result.mse = pixels > 0 ? sum / double(3 * pixels) : 0;
    result.psnr = psnrOf(result.mse);
    return result;
}

double ssim(const ImageView& a, const ImageView& b)
{
    const std::vector<double> window = ssimWindow();
    const size_t pixels = size_t(a.width) * a.height;
    std::vector<float> planes[5]; // planes of a, b, a * a, b * b and a * b
    std::vector<float> blurred[5];
    for (std::vector<float>& plane : planes)
        plane.resize(pixels);
    double sum = 0;
    for (size_t c = 0; c < 3; ++c) {
        for (size_t i = 0; i < pixels; ++i) {
            const float u = a.pixels[3 * i + c], v = b.pixels[3 * i + c];
            planes[0][i] = u;
            planes[1][i] = v;
            planes[2][i] = u * u;
            planes[3][i] = v * v;
            planes[4][i] = u * v;
        }
        for (int k = 0; k < 5; ++k)
            filterPlane(planes[k], a.width, a.height, window, window, Border::Zero, blurred[k]);
        for (size_t i = 0; i < pixels; ++i)
            sum += ssimPixel(blurred[0][i], blurred[1][i], blurred[2][i], blurred[3][i], blurred[4][i]);
    }
    return pixels > 0 ? sum / double(3 * pixels) : 1;
}

void PooledDifference::add(const ImageDifference& difference)
{
    if (frames == 0 || difference.psnr < worst_psnr) {
        worst_psnr = difference.psnr;
        worst_frame = frames;
    }
    mse_sum += difference.mse;
    max_error = std::max(max_error, difference.max_error);
    ++frames;
}

double PooledDifference::psnr() const
{
    return psnrOf(frames > 0 ? mse_sum / double(frames) : 0);
}

} // namespace gsc
