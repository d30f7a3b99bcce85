// SPDX-License-Identifier: Apache-2.0
// Coarse copies of groups on a CPU (README.md): which are due, and how one is made. A copy has the layout that
// projection reads (GaussianTiles), so it is drawn without another conversion.
#pragma once

#include "kernels/coarse/coarse_rule.h"
#include "kernels/project/project.h"

#include <bit>

namespace gsc {

// State of a group and its copy, kept from frame to frame beside the Gaussians of the copy.
struct KeptGroup {
    CoarseKey key{};
    CoarseKind kind = CoarseKind::Unknown;
    bool any_positive = false; // true if some opacity of the group's Gaussians is above zero
    uint32_t count = 0;        // number of Gaussians in the group's copy
    uint32_t anchors = 0;      // number of anchors that the copy was made of
    uint32_t source = 0;       // number of Gaussians that the copy's anchors had
    uint64_t used = 0;         // number of the frame that drew the copy last
    uint64_t made = 0;         // number of the frame that made the copy
};

// Size of the hash table for the cells of so many Gaussians: a power of two, at least twice the number of cells.
inline uint32_t tablePlaces(uint32_t gaussians)
{
    return std::bit_ceil(2 * gaussians + 2);
}

// A Gaussian of a copy: its index before sorting, and the smallest emissionOrder() of the Gaussians that were joined.
struct OrderedGaussian {
    uint64_t order;
    uint32_t at;
};

// Tells where decoded Gaussians come from, to compute their emissionOrder().
struct JoinOrigins {
    const VisibleAnchor* anchors; // anchors whose Gaussians were decoded
    const uint32_t* source_index; // source index of each anchor of the chunk
    uint32_t n_offsets;

    [[nodiscard]] uint64_t order(uint16_t origin) const
    {
        return uint64_t(source_index[anchors[origin / n_offsets].local]) * n_offsets + origin % n_offsets;
    }
};

constexpr uint32_t kCellRow = 16; // floats of a cell's sums, padded to a row

// Memory that one worker uses to make copies.
struct JoinScratch {
    Buffer<float> cells;           // sums of the cells, kCellRow floats each
    Buffer<uint32_t> keys;         // place of each cell on the grid, as a key
    Buffer<uint32_t> table;        // hash table from keys to indices of cells
    Buffer<float> tiles;           // Gaussians of the copy, as GaussianTiles
    Buffer<OrderedGaussian> order; // Gaussians of the copy in the order of their cells
};

void reserveJoin(uint32_t n_offsets, JoinScratch& scratch);

// Makes a group's copy in `scratch`, by joining its small Gaussians, and returns the number of Gaussians in the copy.
// `decoded`: all Gaussians of the group, decoded at the view's centre. Sets `far` to false if the group is near; it
// then gets no copy.
uint32_t joinGroupCpu(const CoarseView& view, const GroupRecord& record, float cell, const GaussianBlock& decoded,
                      const JoinOrigins& origins, JoinScratch& scratch, bool& far);
// Writes the copy to `tiles` in emission order, so Gaussians of equal depth need no sorting. Fills up the last tile.
void storeCopy(const JoinScratch& scratch, uint32_t count, float* tiles);

} // namespace gsc
