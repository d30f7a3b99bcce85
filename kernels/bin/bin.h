// SPDX-License-Identifier: Apache-2.0
// Lists the splats of every 16 x 16 tile from front to back, on a CPU.
#pragma once

#include "kernels/simd/buffer.h"
#include "kernels/sort/sort.h"

#include <vector>

namespace gsc {

class Workers;

struct BinArgs {
    const Splat* splats;   // all splats, by splat slot
    const SortKey* sorted; // slots of the visible splats, front to back
    size_t count;
    uint32_t grid_x, grid_y; // width and height of the picture in tiles
};

// Tiles of a 4 x 4 window that a splat touches, noted when they are counted and read when they are listed.
struct TileWindow {
    uint32_t tile;  // index of the window's first tile
    uint16_t tiles; // bit 4 * row + column is set for a touched tile
    uint16_t last;  // 1 for the last window of its splat, else 0
};

struct BinScratch {
    Buffer<Splat> splats; // copies of the splats, front to back
    // grid_x * grid_y + 1 positions in `entries`: where each tile's list begins, and the end of the last
    Buffer<uint32_t> tile_first;
    Buffer<uint32_t> entries;      // indices into `splats`: the lists of the tiles, each front to back
    Buffer<uint32_t> chunk_counts; // splats per tile, for each chunk of splats, with grid_x + 1 more counters as spare
    // windows of each chunk of splats, kept from frame to frame for their memory
    std::vector<std::vector<TileWindow>> chunk_windows;
};

// Fills scratch.splats, .tile_first and .entries; returns the number of (tile, splat) pairs. A tile in a splat's box
// does not list it if the ellipse on which alpha reaches 1/255 misses the tile. Throws Error(OutOfMemory) beyond 2^32
// pairs.
uint64_t binCpu(const BinArgs& args, const Workers& workers, BinScratch& scratch);

struct TileLists {
    std::vector<uint32_t> first;   // tiles + 1 positions in `entries`
    std::vector<uint32_t> entries; // indices into the splats, tile by tile
};

// Lists as the trainers' code makes them: a splat is in every tile of its 3-sigma rectangle. Scalar reference.
template <typename Real>
TileLists binReference(const std::vector<SplatOf<Real>>& splats, const std::vector<uint32_t>& sorted, uint32_t grid_x,
                       uint32_t grid_y);

} // namespace gsc
