// SPDX-License-Identifier: Apache-2.0
#include "player/measure/fovea.h"

#include "format/error.h"
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

void FoveaScorer::add(uint64_t frame, const FoveaSums (&sides)[2])
{
    for (size_t i = 0; i < 2; ++i) {
        const FoveaSums& own = sides[i];
        Sums& all = m_sums[i];
        if (own.pixels == 0)
            continue;
        const double psnr = decibelsOf(own.squares / double(3 * own.pixels));
        if (all.pixels == 0 || psnr < all.psnr_min) {
            all.psnr_min = psnr;
            all.psnr_min_frame = frame;
        }
        all.pixels += own.pixels;
        all.squares += own.squares;
        if (own.flip) {
            all.flip_pixels += own.pixels;
            all.flip += *own.flip;
        }
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
