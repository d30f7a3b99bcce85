// SPDX-License-Identifier: Apache-2.0
// The trainers' own pictures, and how far ours are from them.
#pragma once

#include <gsc/error.h>
#include "runtime/image/image_io.h"
#include "runtime/metrics/metrics.h"

#include <cstdio>
#include <string>

namespace gsc::test {

// The largest error of any pixel, of 1. Rounding leaves it: a splat that touches one tile more or less, or two that
// swap depths.
constexpr double kWorstPixel = 0.005;

inline ImageView viewOf(const Image& image)
{
    return {image.pixels.data(), image.width, image.height};
}

inline std::string differenceText(const ImageDifference& difference)
{
    return formatString("PSNR %6.2f dB, worst pixel %.5f at (%u, %u), above 1/255: %llu", difference.psnr,
                        difference.max_error, difference.max_x, difference.max_y,
                        static_cast<unsigned long long>(difference.over_1_255));
}

inline void printPooled(const char* what, const PooledDifference& pooled)
{
    std::printf("%s pooled over %llu views: PSNR %.2f dB, worst view %.2f dB, worst pixel %.5f\n", what,
                static_cast<unsigned long long>(pooled.frames), pooled.psnr(), pooled.worst_psnr, pooled.max_error);
    std::fflush(stdout);
}

} // namespace gsc::test
