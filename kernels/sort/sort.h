// SPDX-License-Identifier: Apache-2.0
// Depth order of one eye's splats. Upstream sorts (tile, depth) pairs stably; sorting the splats once by depth and
// binning them in that order gives the same lists for a quarter of the keys (measured: pairs are 4 to 15 per splat).
#pragma once

#include "kernels/simd/buffer.h"
#include "kernels/project/project.h"
#include "kernels/select/select.h"
#include "kernels/sort/sort_key.h"

#include <vector>

namespace gsc {

class Workers;

// Splats lie in blocks: block b holds counts[b] of them from slot b * block_capacity on.
struct SortArgs {
    const ModelView* model;       // null: splats of equal depth stay as they lie
    const VisibleAnchor* visible; // kDecodeBlock per block
    const uint32_t* depth_bits;   // per slot
    const uint16_t* origins;      // per slot, GaussianBlock::origin
    const uint32_t* counts;       // per block
    uint32_t block_count;
    uint32_t block_capacity;
    const uint32_t* groups = nullptr; // per block, where blocks are groups; `visible` is not read then
    uint32_t ordered_blocks = ~0u;    // splats of later blocks stay as they lie, behind the others
};

// Keys [begin, end) of equal depth.
struct SortRun {
    size_t begin, end;
};

struct SortScratch {
    Buffer<SortKey> keys[2];
    Buffer<uint32_t> histograms;
    Buffer<uint32_t> block_first;
    std::vector<std::vector<SortRun>> runs; // per chunk of keys; kept from frame to frame for their memory
};

// Slots by depth, ties by upstream's emission order (trap 28). The result lies in scratch.keys[0]; returns how many.
size_t sortCpu(const SortArgs& args, const Workers& workers, SortScratch& scratch);

// Indices of `splats` by depth, then order. Scalar.
template <typename Real>
std::vector<uint32_t> sortReference(const std::vector<SplatOf<Real>>& splats);

} // namespace gsc
