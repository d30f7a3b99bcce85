// SPDX-License-Identifier: Apache-2.0
// Errors of a picture, summed over squares of 16 x 16 pixels: the same arithmetic on a CPU and a GPU. Sums of whole
// pictures are sums of these in the order of the squares, so that they do not depend on what ran beside what.
#pragma once

#include <gsc/hostdev.h>
#include <gsc/frame_types.h>
#include "kernels/math/foveation.h"

#include <cmath>
#include <cstdint>

namespace gsc {

constexpr uint32_t kScoreSquare = 16; // pixels of a side; squares at the right and the bottom edge are smaller

// An eye and its gaze, right and down at depth 1.
struct EyeGaze {
    EyeParams eye{};
    float x = 0, y = 0;
};

// True if the middle of that pixel is within 12 degrees of the gaze, where foveation draws everything (kFoveaInner).
GSC_HD bool inFovea(const EyeGaze& gaze, uint32_t column, uint32_t row)
{
    const EyeParams& eye = gaze.eye;
    const double u = (column + 0.5 - 0.5 * eye.width) / double(eye.focal_x) + double(eye.tan_mid_x);
    const double v = (row + 0.5 - 0.5 * eye.height) / double(eye.focal_y) + double(eye.tan_mid_y);
    const double x = double(gaze.x), y = double(gaze.y);
    const double cosine = (u * x + v * y + 1) / sqrt((u * u + v * v + 1) * (x * x + y * y + 1));
    return cosine >= double(kFoveaInner);
}

// Scores of a square's pixels; sums are over their three channels. `error` and `pixels`: of the pixels in the fovea,
// then of the others.
struct SquareSums {
    double error[2]; // squares of image - exact; infinite where that is no number
    double change;   // squares of the change of image - exact since the picture before
    double motion;   // squares of the change of the image
    double largest;  // error of a channel
    uint32_t pixels[2];
    uint32_t over_1_255; // pixels with a channel off by more
};

// Adds one pixel. `last_error` and `last_image`, three floats each, are of the picture before; those of this one take
// their place.
GSC_HD void addPixel(SquareSums& sums, bool in_fovea, const float* image, const float* exact, float* last_error,
                     float* last_image)
{
    double largest = 0;
    for (int c = 0; c < 3; ++c) {
        double error = fabs(double(image[c]) - double(exact[c]));
        if (!(error >= 0)) // a NaN against anything is as wrong as can be, never invisible
            error = double(INFINITY);
        sums.error[in_fovea ? 0 : 1] += error * error;
        largest = error > largest ? error : largest;
        const float difference = image[c] - exact[c];
        const double change = double(difference) - double(last_error[c]);
        const double motion = double(image[c]) - double(last_image[c]);
        sums.change += change * change;
        sums.motion += motion * motion;
        last_error[c] = difference;
        last_image[c] = image[c];
    }
    sums.largest = largest > sums.largest ? largest : sums.largest;
    sums.over_1_255 += largest > 1.0 / 255 ? 1 : 0;
    ++sums.pixels[in_fovea ? 0 : 1];
}

// Adds the sums of other pixels of the square.
GSC_HD void addSums(SquareSums& sums, const SquareSums& other)
{
    for (int part = 0; part < 2; ++part) {
        sums.error[part] += other.error[part];
        sums.pixels[part] += other.pixels[part];
    }
    sums.change += other.change;
    sums.motion += other.motion;
    sums.largest = other.largest > sums.largest ? other.largest : sums.largest;
    sums.over_1_255 += other.over_1_255;
}

// FLIP of the pixels of a square, of those in the fovea and of the others.
struct SquareFlip {
    double error[2];
};

} // namespace gsc
