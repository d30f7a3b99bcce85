// SPDX-License-Identifier: Apache-2.0
// Projects Gaussians to splats in the image of one eye (format facts 7.2, 7.3), on a CPU.
#pragma once

#include "kernels/simd/read_ahead.h"
#include "kernels/decode/decode.h"
#include "kernels/math/eye.h"

#include <vector>

namespace gsc {

// A splat as blending reads it, 48 bytes. The box of pixels is inclusive: the 3-sigma tiles of the trainers' code, cut
// by a box that holds every pixel where alpha can reach 1/255, so that nothing which they draw is cut.
struct Splat {
    float x, y;              // byte 0: centre in pixels; pixel centres are whole numbers
    float conic[3];          // byte 8: inverse of the covariance: xx, xy, yy
    float opacity;           // byte 20: opacity, 0 to 1
    float color[3];          // byte 24: red, green, blue
    float cutoff;            // byte 36: alpha can reach 1/255 only where power >= -cutoff, which allows for rounding
    uint16_t x0, y0, x1, y1; // byte 40: box of pixels, ends inclusive
};
static_assert(sizeof(Splat) == 48);

// Cutoff of splats whose ellipse is not trusted, because they are too thin or their determinant is negative; larger
// than any other. Such splats fill the trainers' tiles.
constexpr float kLooseCutoff = 16;

struct ProjectArgs {
    const EyeParams* eye;
    RasterConstants rules;
    ReadAhead* ahead = nullptr; // cache lines to prefetch meanwhile, since projection computes much and reads little
    ColumnRange columns{};      // columns to which boxes of pixels are cut; a splat whose box is then empty is left out
};

struct ProjectCounts {
    uint32_t splats;
    uint32_t dropped; // number of Gaussians that are not finite (format facts, traps 18, 19)
};

// Layout of Gaussians that are kept as they are projected: tiles of kMaxLanes Gaussians, with these rows of values.
enum TileRow : uint32_t {
    kTilePosition = 0,   // three rows: x, y, z, world units
    kTileCovariance = 3, // six rows: xx, xy, xz, yy, yz, zz, world units squared
    kTileOpacity = 9,
    kTileColor = 10,
    kTileRows = 13
};
constexpr size_t kTileValues = size_t(kTileRows) * kMaxLanes;

// Gaussians in tiles; the last tile is filled up with any finite values.
struct GaussianTiles {
    const float* values; // aligned like the memory of a Buffer
    uint32_t count;
};

// Projects a block of Gaussians, and writes the visible ones in the block's order without gaps, at most gaussians.count
// of each array. `depth_bits` are the bits of view z, which as integers have the order of the depths, since these are
// positive.
ProjectCounts projectBlockCpu(const ProjectArgs& args, const GaussianBlock& gaussians, Splat* splats,
                              uint32_t* depth_bits, uint16_t* origins);
// Projects as projectBlockCpu() does, but writes no origins, since Gaussians in tiles have none.
ProjectCounts projectTilesCpu(const ProjectArgs& args, const GaussianTiles& gaussians, Splat* splats,
                              uint32_t* depth_bits);

template <typename Real>
struct SplatOf {
    Real x, y, conic[3], opacity, color[3], depth;
    TileRect tiles; // tiles in which the trainers' code draws the splat
    uint64_t order;
};

// Scalar reference. Keeps every Gaussian that the trainers' code would draw, in order; counts those that are not
// finite.
template <typename Real>
std::vector<SplatOf<Real>> projectReference(const EyeOf<Real>& eye, const RasterConstants& rules,
                                            const std::vector<GaussianOf<Real>>& gaussians, uint64_t& dropped);

} // namespace gsc
