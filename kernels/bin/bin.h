// SPDX-License-Identifier: Apache-2.0
// The splats of every 16 x 16 tile, front to back.
#pragma once

#include "kernels/simd/buffer.h"
#include "kernels/sort/sort.h"

#include <vector>

namespace gsc {

class Workers;

struct BinArgs {
    const Splat* splats;   // by slot
    const SortKey* sorted; // front to back
    size_t count;
    uint32_t grid_x, grid_y; // tiles
};

// Tiles that a splat touches in a window of 4 x 4, between counting and listing.
struct TileWindow {
    uint32_t tile;  // the window's first
    uint16_t tiles; // bit 4 row + column
    uint16_t last;  // 1 for the last window of its splat
};

struct BinScratch {
    Buffer<Splat> splats;                               // front to back
    Buffer<uint32_t> tile_first;                        // grid_x * grid_y + 1 positions in `entries`
    Buffer<uint32_t> entries;                           // indices into `splats`, per tile front to back
    Buffer<uint32_t> chunk_counts;                      // per chunk of splats and tile, and grid_x + 1 to spare
    std::vector<std::vector<TileWindow>> chunk_windows; // kept from frame to frame for their memory
};

// Fills scratch.splats, .tile_first and .entries; returns the number of (tile, splat) pairs. A tile is left out of a
// splat's box where the ellipse on which alpha reaches 1/255 misses it. Throws Error(OutOfMemory) beyond 2^32 pairs.
uint64_t binCpu(const BinArgs& args, const Workers& workers, BinScratch& scratch);

struct TileLists {
    std::vector<uint32_t> first;   // tiles + 1
    std::vector<uint32_t> entries; // indices into the splats
};

// Upstream's lists: every tile of the 3-sigma rectangle. Scalar.
template <typename Real>
TileLists binReference(const std::vector<SplatOf<Real>>& splats, const std::vector<uint32_t>& sorted, uint32_t grid_x,
                       uint32_t grid_y);

} // namespace gsc
