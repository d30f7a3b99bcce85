// SPDX-License-Identifier: Apache-2.0
// Projects Gaussians to splats of one eye's image (format facts 7.2, 7.3).
#pragma once

#include "kernels/simd/read_ahead.h"
#include "kernels/decode/decode.h"
#include "kernels/math/eye.h"

#include <vector>

namespace gsc {

// A splat, as blending reads it, 48 bytes. The pixel box is inclusive: upstream's 3-sigma tiles intersected with a box
// that holds every pixel on which alpha can reach 1/255, so it cuts nothing that upstream draws.
struct Splat {
    float x, y;              // 0   pixels, centres at integers
    float conic[3];          // 8
    float opacity;           // 20
    float color[3];          // 24
    float cutoff;            // 36  alpha can reach 1/255 only where power >= -cutoff; rounding is allowed for
    uint16_t x0, y0, x1, y1; // 40 pixel box
};
static_assert(sizeof(Splat) == 48);

// Cutoff of splats whose ellipse is not trusted, because they are too thin or their determinant is negative: larger
// than any other. They fill upstream's tiles.
constexpr float kLooseCutoff = 16;

struct ProjectArgs {
    const EyeParams* eye;
    RasterConstants rules;
    ReadAhead* ahead = nullptr; // cache lines to prefetch meanwhile: projection computes much and reads little
    ColumnRange columns{};      // pixel boxes are cut to these columns; an empty one is left out
};

struct ProjectCounts {
    uint32_t splats;
    uint32_t dropped; // not finite (traps 18, 19)
};

// Gaussians that are kept as they are projected, in tiles of kMaxLanes: each a row of values for each of these.
enum TileRow : uint32_t {
    kTilePosition = 0,   // x, y, z
    kTileCovariance = 3, // xx, xy, xz, yy, yz, zz, world units
    kTileOpacity = 9,
    kTileColor = 10,
    kTileRows = 13
};
constexpr size_t kTileValues = size_t(kTileRows) * kMaxLanes;

// The last tile is filled up with anything finite.
struct GaussianTiles {
    const float* values; // aligned as a Buffer
    uint32_t count;
};

// Writes the splats of a block, densely, in the block's order: at most gaussians.count of each array.
// `depth_bits` are the bits of view z, which order like the depths because those are positive.
ProjectCounts projectBlockCpu(const ProjectArgs& args, const GaussianBlock& gaussians, Splat* splats,
                              uint32_t* depth_bits, uint16_t* origins);
// Writes splats as projectBlockCpu() does, but no origins, which such Gaussians do not have.
ProjectCounts projectTilesCpu(const ProjectArgs& args, const GaussianTiles& gaussians, Splat* splats,
                              uint32_t* depth_bits);

template <typename Real>
struct SplatOf {
    Real x, y, conic[3], opacity, color[3], depth;
    TileRect tiles; // upstream's
    uint64_t order;
};

// Scalar. Keeps every Gaussian upstream would draw, in the order given; counts those that are not finite.
template <typename Real>
std::vector<SplatOf<Real>> projectReference(const EyeOf<Real>& eye, const RasterConstants& rules,
                                            const std::vector<GaussianOf<Real>>& gaussians, uint64_t& dropped);

} // namespace gsc
