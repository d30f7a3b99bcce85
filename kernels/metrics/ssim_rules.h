// SPDX-License-Identifier: Apache-2.0
// Structural similarity of one channel of a pixel (Wang et al. 2004), equal on a CPU and a GPU.
#pragma once

#include <gsc/hostdev.h>

namespace gsc {

// SSIM at a pixel, from blurred values: images a and b, their squares, and their product.
GSC_HD double ssimPixel(float a, float b, float aa, float bb, float ab)
{
    constexpr double kC1 = 0.01 * 0.01, kC2 = 0.03 * 0.03;
    const double mean_a = double(a), mean_b = double(b);
    const double var_a = double(aa) - mean_a * mean_a, var_b = double(bb) - mean_b * mean_b;
    const double cov = double(ab) - mean_a * mean_b;
    return (2 * mean_a * mean_b + kC1) * (2 * cov + kC2) /
           ((mean_a * mean_a + mean_b * mean_b + kC1) * (var_a + var_b + kC2));
}

} // namespace gsc
