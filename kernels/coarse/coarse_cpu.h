// SPDX-License-Identifier: Apache-2.0
// Coarse copies of groups on a CPU (README.md): which are due, and how a copy is made. A copy has the layout that projection
// reads (GaussianTiles), so it is drawn without another conversion.
#pragma once

#include "kernels/coarse/coarse_rule.h"
#include "kernels/project/project.h"

#include <bit>

namespace gsc {

// State of a group, kept from frame to frame beside the Gaussians of its copy.
struct KeptGroup {
    CoarseKey key{};
    CoarseKind kind = CoarseKind::Unknown;
    bool any_positive = false; // GaussianBlock
    uint32_t count = 0;        // Gaussians of its copy
    uint32_t anchors = 0;      // anchors that its copy was made of
    uint32_t source = 0;       // Gaussians of these anchors
    uint64_t used = 0;         // frame that drew the copy last
    uint64_t made = 0;         // frame that made the copy
};

// Size of the hash table of cells: a power of two, at least twice the number of cells.
inline uint32_t tablePlaces(uint32_t gaussians)
{
    return std::bit_ceil(2 * gaussians + 2);
}

// A Gaussian of a copy: its index before sorting, and the least emissionOrder() of the Gaussians it was made of.
struct OrderedGaussian {
    uint64_t order;
    uint32_t at;
};

// Origins of decoded Gaussians, for their emissionOrder().
struct JoinOrigins {
    const VisibleAnchor* anchors; // decoded anchors
    const uint32_t* source_index; // source index of each anchor of the chunk
    uint32_t n_offsets;

    [[nodiscard]] uint64_t order(uint16_t origin) const
    {
        return uint64_t(source_index[anchors[origin / n_offsets].local]) * n_offsets + origin % n_offsets;
    }
};

constexpr uint32_t kCellRow = 16; // floats per cell, padded

// Memory of one worker.
struct JoinScratch {
    Buffer<float> cells;           // kCellRow each
    Buffer<uint32_t> keys;         // place of each cell on the grid
    Buffer<uint32_t> table;        // cells by keys
    Buffer<float> tiles;           // the copy's Gaussians
    Buffer<OrderedGaussian> order; // Gaussians in the order of their cells
};

void reserveJoin(uint32_t n_offsets, JoinScratch& scratch);

// Joins a group's Gaussians into its copy, in `scratch`, and returns their number. `decoded`: all Gaussians of the group,
// decoded at the view's centre. Sets far to false if the group is near and gets no copy.
uint32_t joinGroupCpu(const CoarseView& view, const GroupRecord& record, float cell, const GaussianBlock& decoded,
                      const JoinOrigins& origins, JoinScratch& scratch, bool& far);
// Writes the copy in emission order, so that Gaussians of equal depth need no sorting. Fills the last tile up.
void storeCopy(const JoinScratch& scratch, uint32_t count, float* tiles);

} // namespace gsc
