// SPDX-License-Identifier: Apache-2.0
// Errors of a picture, summed over squares of 16 x 16 pixels with equal arithmetic on a CPU and a GPU. Sums of whole
// pictures add these up in the order of the squares, so that they do not depend on what ran at the same time.
#pragma once

#include <gsc/hostdev.h>
#include <gsc/frame_types.h>
#include "kernels/math/foveation.h"

#include <cmath>
#include <cstdint>

namespace gsc {

// width and height of a square in pixels; squares at the right and bottom edge may be smaller
constexpr uint32_t kScoreSquare = 16;

// An eye and the direction of its gaze, right and down at depth 1.
struct EyeGaze {
    EyeParams eye{};
    float x = 0, y = 0;
};

// Returns true if the middle of the pixel is within 12 degrees of the gaze, where foveation draws everything
// (kFoveaInner).
GSC_HD bool inFovea(const EyeGaze& gaze, uint32_t column, uint32_t row)
{
    const EyeParams& eye = gaze.eye;
    const double u = (column + 0.5 - 0.5 * eye.width) / double(eye.focal_x) + double(eye.tan_mid_x);
    const double v = (row + 0.5 - 0.5 * eye.height) / double(eye.focal_y) + double(eye.tan_mid_y);
    const double x = double(gaze.x), y = double(gaze.y);
    const double cosine = (u * x + v * y + 1) / sqrt((u * u + v * v + 1) * (x * x + y * y + 1));
    return cosine >= double(kFoveaInner);
}

// Scores of the pixels of a square; sums are over three channels. `error` and `pixels` have one element for pixels in
// the fovea and one for the others.
struct SquareSums {
    double error[2]; // sums of (image - exact)^2; infinite where that is NaN
    double change;   // sum of the squared changes of (image - exact) since the picture before
    double motion;   // sum of the squared changes of the image since the picture before
    double largest;  // largest |image - exact| of a channel
    uint32_t pixels[2];
    uint32_t over_1_255; // number of pixels with a channel that is wrong by more than 1/255
};

// Adds one pixel to `sums`. `last_error` and `last_image` have three floats each, those of the picture before, which
// are replaced by those of this picture.
GSC_HD void addPixel(SquareSums& sums, bool in_fovea, const float* image, const float* exact, float* last_error,
                     float* last_image)
{
    double largest = 0;
    for (int c = 0; c < 3; ++c) {
        double error = fabs(double(image[c]) - double(exact[c]));
        if (!(error >= 0)) // NaN, compared with anything, counts as the largest error
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

// Adds the sums of other pixels of the square to `sums`.
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

// FLIP of a square, summed over pixels in the fovea and over the others.
struct SquareFlip {
    double error[2];
};

} // namespace gsc
