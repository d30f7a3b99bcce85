// SPDX-License-Identifier: Apache-2.0
// Splats made by hand, sorted and dealt to bins, and what a pixel of them is, with what rounding may do to it.
#pragma once

#include "kernels/decode/decode_cuda.h"
#include "kernels/math/projection.h"
#include "tests/kernels/gpu_stage.h"

namespace gsc::test {

struct Size {
    uint32_t width, height;
};

// Input of blending a frame, before it is cut into passes.
template <typename Splat>
struct BlendScene {
    std::vector<Size> eyes;
    BinGrid grid;
    std::vector<Splat> splats;                // front to back
    std::vector<std::vector<uint32_t>> lists; // eye-major, per bin: indices of splats
    RasterConstants rules;
    float background[3] = {0.25f, 0.5f, 1};
    bool empty_is_black = true;
    uint32_t any_positive = 1;
};

struct Ellipse {
    float x, y, a, b, c; // covariance in pixels squared
    float opacity, color[3];
    TileRect tiles;
};

template <typename Splat>
BlendScene<Splat> emptyScene(const std::vector<Size>& eyes, uint32_t bin_height, RasterRules raster);

// To every bin of the eye that its tiles touch, and one more all round: lists may hold splats that miss their bin.
template <typename Splat>
void addSplat(BlendScene<Splat>& scene, uint32_t eye, const Ellipse& ellipse);

// Size of a splat, in double: covariance along x and y, and upstream's radius before it is rounded up.
struct Spread {
    double xx, yy, radius;
};
Spread spreadOf(const PackedSplat& splat, const RasterConstants& rules);

// Is a pixel in the tiles of a splat of this radius?
bool inTiles(const PackedSplat& splat, const RasterConstants& rules, double radius, uint32_t x, uint32_t y);

struct Shapes {
    float opacity_min = 0.005f, opacity_max = 1, sigma_max = 20;
    bool hollow = false; // also splats whose determinant is negative: upstream draws them (trap 21)
};

template <typename Splat>
BlendScene<Splat> randomScene(const std::vector<Size>& eyes, uint32_t bin_height, RasterRules raster, uint32_t count,
                              uint32_t seed, const Shapes& shapes = {});

struct Pixel {
    double color[3] = {}, bound = 0; // bound: most difference of an fp32 blend
    float depth = INFINITY;          // 1 + the index of the splat behind which less than half of the light goes on
    bool depth_doubtful = false;
};

// In double; the bound follows from what rounding does to every alpha. A splat that rounding may make appear counts as
// an error of its whole alpha, a pixel that it may finish one splat earlier as one of all that is left.
template <typename Splat>
Pixel referencePixel(const BlendScene<Splat>& scene, const std::vector<uint32_t>& list, uint32_t x, uint32_t y);

} // namespace gsc::test
