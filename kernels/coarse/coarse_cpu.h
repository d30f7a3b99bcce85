// SPDX-License-Identifier: Apache-2.0
// Coarse copies of groups on a CPU (README.md): what is due, and how a group becomes its copy. A copy is what projecting reads
// (GaussianTiles): drawing it costs nothing else.
#pragma once

#include "kernels/coarse/coarse_rule.h"
#include "kernels/project/project.h"

#include <bit>

namespace gsc {

// Kept of a group, beside the Gaussians of its copy.
struct KeptGroup {
    CoarseKey key{};
    CoarseKind kind = CoarseKind::Unknown;
    bool any_positive = false; // GaussianBlock
    uint32_t count = 0;        // Gaussians of its copy
    uint32_t anchors = 0;      // that its copy was made of
    uint32_t source = 0;       // Gaussians of these
    uint64_t used = 0;         // frame that drew it last
    uint64_t made = 0;         // frame that made it
};

// A power of two, at least twice as many as there can be cells.
inline uint32_t tablePlaces(uint32_t gaussians)
{
    return std::bit_ceil(2 * gaussians + 2);
}

// A Gaussian of a copy: where it lies before they are ordered, and the least emissionOrder() of what it was made of.
struct OrderedGaussian {
    uint64_t order;
    uint32_t at;
};

// Where decoded Gaussians come from: emissionOrder() of their origins.
struct JoinOrigins {
    const VisibleAnchor* anchors; // that were decoded
    const uint32_t* source_index; // of their chunk
    uint32_t n_offsets;

    [[nodiscard]] uint64_t order(uint16_t origin) const
    {
        return uint64_t(source_index[anchors[origin / n_offsets].local]) * n_offsets + origin % n_offsets;
    }
};

constexpr uint32_t kCellRow = 16; // floats that a cell gathers, and some more

// One worker's.
struct JoinScratch {
    Buffer<float> cells;           // kCellRow each
    Buffer<uint32_t> keys;         // of cells: place on the grid
    Buffer<uint32_t> table;        // cells by keys
    Buffer<float> tiles;           // the copy's Gaussians
    Buffer<OrderedGaussian> order; // of them
};

void reserveJoin(uint32_t n_offsets, JoinScratch& scratch);

// The Gaussians of a group's copy, in scratch; returns how many. `decoded`: all that the group shows from the view's centre,
// decoded there. far: false where the group is near: there is no copy.
uint32_t joinGroupCpu(const CoarseView& view, const GroupRecord& record, float cell, const GaussianBlock& decoded,
                      const JoinOrigins& origins, JoinScratch& scratch, bool& far);
// Copies it as it is kept: in emission order, so that those of equal depth need not be sorted. Fills the last tile up.
void storeCopy(const JoinScratch& scratch, uint32_t count, float* tiles);

} // namespace gsc
