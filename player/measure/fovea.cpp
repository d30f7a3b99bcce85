// SPDX-License-Identifier: Apache-2.0
#include "player/measure/fovea.h"

#include "format/error.h"
#include "kernels/math/foveation.h"
#include "player/measure/accuracy.h"
#include "player/report/report_parts.h"

#include <cmath>
#include <limits>

namespace gsc {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

double decibelsOf(double mse)
{
    return mse > 0 ? -10 * std::log10(mse) : kInfinity;
}

std::string partText(const FoveaAccuracy::Part& part)
{
    if (part.share == 0)
        return "no pixel";
    std::string text = formatString("PSNR %s pooled, %s worst", decibels(boundedPsnr(part.psnr_pooled), " dB").c_str(),
                                    decibels(boundedPsnr(part.psnr_min), " dB").c_str());
    return part.flip < 0 ? text : text + formatString(", FLIP %.4f", part.flip);
}

} // namespace

bool inFovea(const EyeGaze& gaze, uint32_t column, uint32_t row)
{
    const EyeParams& eye = gaze.eye;
    const double u = (column + 0.5 - 0.5 * eye.width) / double(eye.focal_x) + double(eye.tan_mid_x);
    const double v = (row + 0.5 - 0.5 * eye.height) / double(eye.focal_y) + double(eye.tan_mid_y);
    const double x = double(gaze.x), y = double(gaze.y);
    const double cosine = (u * x + v * y + 1) / std::sqrt((u * u + v * v + 1) * (x * x + y * y + 1));
    return cosine >= double(kFoveaInner);
}

void FoveaScorer::add(uint64_t frame, const ImageView& image, const ImageView& exact, const EyeGaze& gaze,
                      std::span<const float> flip_map)
{
    Sums own[2];
    for (uint32_t row = 0; row < image.height; ++row)
        for (uint32_t column = 0; column < image.width; ++column) {
            Sums& part = own[inFovea(gaze, column, row) ? 0 : 1];
            const size_t at = size_t(row) * image.width + column;
            for (size_t c = 3 * at; c < 3 * at + 3; ++c) {
                const double error = double(image.pixels[c]) - double(exact.pixels[c]);
                part.squares += std::isnan(error) ? kInfinity : error * error; // as in compareImages()
            }
            ++part.pixels;
            if (!flip_map.empty()) {
                part.flip += double(flip_map[at]);
                ++part.flip_pixels;
            }
        }
    for (size_t i = 0; i < 2; ++i) {
        Sums& all = m_sums[i];
        if (own[i].pixels == 0)
            continue;
        const double psnr = decibelsOf(own[i].squares / double(3 * own[i].pixels));
        if (all.pixels == 0 || psnr < all.psnr_min) {
            all.psnr_min = psnr;
            all.psnr_min_frame = frame;
        }
        all.pixels += own[i].pixels;
        all.flip_pixels += own[i].flip_pixels;
        all.squares += own[i].squares;
        all.flip += own[i].flip;
    }
}

FoveaAccuracy FoveaScorer::result() const
{
    FoveaAccuracy result;
    const auto every = double(m_sums[0].pixels + m_sums[1].pixels);
    for (size_t i = 0; i < 2; ++i) {
        const Sums& sums = m_sums[i];
        FoveaAccuracy::Part& part = i == 0 ? result.inside : result.outside;
        if (sums.pixels == 0)
            continue;
        part.share = double(sums.pixels) / every;
        part.psnr_pooled = decibelsOf(sums.squares / double(3 * sums.pixels));
        part.psnr_min = sums.psnr_min;
        part.psnr_min_frame = sums.psnr_min_frame;
        if (sums.flip_pixels > 0)
            part.flip = sums.flip / double(sums.flip_pixels);
    }
    return result;
}

std::string foveaText(const FoveaAccuracy& accuracy)
{
    return "within 12 degrees of the gaze: " + partText(accuracy.inside) +
           "; around it: " + partText(accuracy.outside) + "\n";
}

} // namespace gsc
