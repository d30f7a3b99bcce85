// SPDX-License-Identifier: Apache-2.0
// An image behind a lens that hides part of it, held against the whole image.
#pragma once

#include "tests/kernels/band_tools.h"

#include <cmath>

namespace gsc::test {

// A lens that shows an ellipse about the middle of the image, `share` of its size.
inline LensShape ellipseLens(const EyeParams& eye, double share)
{
    LensShape lens;
    lens.masks = true;
    const double middle_x = eye.width / 2.0 / kLensSquare, middle_y = eye.height / 2.0 / kLensSquare;
    for (uint32_t row = 0; row * kLensSquare < eye.height && row < kLensRows; ++row) {
        const double y = (row + 0.5 - middle_y) / (share * middle_y), half = share * middle_x * std::sqrt(1 - y * y);
        if (std::isnan(half))
            continue; // hidden as a whole
        lens.first[row] = uint8_t(std::max(std::floor(middle_x - half), 0.0));
        lens.end[row] = uint8_t(std::ceil(middle_x + half));
    }
    return lens;
}

// Draws the image with and without `lenses`, one for each eye, and checks every pixel. Returns the share of the whole image's
// evaluations that the lenses left.
inline double checkLens(Renderer& renderer, const std::vector<EyeParams>& eyes, FrameOptions options,
                        const std::vector<LensShape>& lenses, PixelFormat format = PixelFormat::Rgb32f,
                        bool depths = false)
{
    const auto evaluations = [](const FrameResult& result) {
        return double(result.eyes[0].blend_evaluations + result.eyes[1].blend_evaluations);
    };
    const BandPicture whole = drawBand(renderer, eyes, options, format, depths);
    std::ranges::copy(lenses, options.lens);
    const BandPicture seen = drawBand(renderer, eyes, options, format, depths);
    const size_t bytes = pixelBytes(format);
    for (size_t e = 0; e < eyes.size(); ++e) {
        CAPTURE(e);
        const uint32_t width = eyes[e].width, height = eyes[e].height;
        size_t wrong = 0, wrong_depths = 0, hidden = 0;
        for (uint32_t y = 0; y < height; ++y)
            for (uint32_t x = 0; x < width; ++x) {
                const size_t at = y * (width * bytes + kBandGap) + x * bytes;
                const size_t depth_at = y * (4 * size_t(width) + kBandGap) + 4 * size_t(x);
                float depth = 0;
                if (depths)
                    std::memcpy(&depth, seen.depths[e].data() + depth_at, 4);
                if (lenses[e].shows(x / kLensSquare, y / kLensSquare)) {
                    wrong += std::memcmp(&seen.pixels[e][at], &whole.pixels[e][at], bytes) != 0;
                    wrong_depths +=
                        depths && std::memcmp(&seen.depths[e][depth_at], &whole.depths[e][depth_at], 4) != 0;
                    continue;
                }
                ++hidden;
                const size_t colour = format == PixelFormat::Rgb32f ? bytes : bytes / 4 * 3; // alpha is 1
                wrong += std::any_of(&seen.pixels[e][at], &seen.pixels[e][at] + colour, [](auto b) { return b != 0; });
                wrong_depths += depths && depth != INFINITY;
            }
        CHECK(hidden > 0);
        CHECK(wrong == 0);
        CHECK(wrong_depths == 0);
    }
    return evaluations(seen.result) / evaluations(whole.result);
}

} // namespace gsc::test
