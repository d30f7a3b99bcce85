// SPDX-License-Identifier: Apache-2.0
// Blends splats into pixels from front to back (format facts 7.5), on a CPU.
#pragma once

#include "kernels/bin/bin.h"
#include <gsc/frame_target.h>
#include "kernels/math/blend.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace gsc {

class Workers;

struct BlendArgs {
    const Splat* splats;        // splats of the frame, front to back
    const uint32_t* tile_first; // grid_x * grid_y + 1 positions in `entries`: where each tile's list begins
    const uint32_t* entries;
    uint32_t grid_x, grid_y;
    uint32_t width, height;
    RasterConstants rules;
    float background[3] = {};
    float* image = nullptr; // height x width x 3 values, row 0 at the top
    DepthRows<float> depth{};
    const SortKey* sorted = nullptr; // depths of the splats, needed where depths are wanted
    ColumnRange columns{};           // columns of the image that are drawn
    bool cost = false;               // draws FrameView::Cost: colours show the number of evaluations of pixels
    LensShape lens{};                // lens of the eye; tiles that it hides are not written
    // If not null, no picture is drawn. For each entry of a tile that is drawn: the squares of the splat's weights
    // (transmittance times alpha), summed over the pixels of the tile.
    float* squares = nullptr;
};

// Blends all tiles; returns the number of (pixel, splat) pairs evaluated.
uint64_t blendCpu(const BlendArgs& args, const Workers& workers);

// Scalar reference: every pixel of a tile goes through the tile's list until the pixel is done.
template <typename Real>
uint64_t blendReference(const std::vector<SplatOf<Real>>& splats, const TileLists& lists, uint32_t width,
                        uint32_t height, const RasterConstants& rules, const float* background, Real* image,
                        const DepthRows<Real>& depth = {}, const ColumnRange& columns = {}, bool cost = false);

// Writes the image of a frame without any splat: `color`, and depth infinity.
template <typename Real>
void blendNothing(uint32_t width, uint32_t height, const float* color, Real* image, const DepthRows<Real>& depth,
                  const ColumnRange& columns = {})
{
    const ColumnRange drawn = columns.within(width);
    for (uint32_t y = 0; y < height; ++y) {
        for (uint32_t x = drawn.first; x < drawn.end; ++x)
            std::copy_n(color, 3, image + 3 * (size_t(y) * width + x));
        if (depth.z != nullptr)
            std::fill_n(depth.z + y * depth.stride + drawn.first, drawn.end - drawn.first, Real(INFINITY));
    }
}

// Paints the pixels that a lens hides black, with depth infinity, in the columns that are drawn.
template <typename Real>
void blendHidden(uint32_t width, uint32_t height, const LensShape& lens, Real* image, const DepthRows<Real>& depth,
                 const ColumnRange& columns = {})
{
    const ColumnRange drawn = columns.within(width);
    for (uint32_t y = 0; lens.masks && y < height; ++y)
        for (uint32_t x = drawn.first; x < drawn.end; ++x) {
            if (lens.shows(x / kLensSquare, y / kLensSquare))
                continue;
            std::fill_n(image + 3 * (size_t(y) * width + x), 3, Real(0));
            if (depth.z != nullptr)
                depth.z[y * depth.stride + x] = Real(INFINITY);
        }
}

} // namespace gsc
