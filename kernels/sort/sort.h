// SPDX-License-Identifier: Apache-2.0
// Sorts the splats of one eye by depth, on a CPU. The trainers' code sorts (tile, depth) pairs stably. To sort the
// splats once by depth and then bin them in that order gives equal lists for a quarter of the keys (measured: 4 to 15
// pairs per splat).
#pragma once

#include "kernels/simd/buffer.h"
#include "kernels/project/project.h"
#include "kernels/select/select.h"
#include "kernels/sort/sort_key.h"

#include <vector>

namespace gsc {

class Workers;

// Arguments of the sort. Splats lie in blocks: block b holds counts[b] splats, from slot b * block_capacity on.
struct SortArgs {
    const ModelView* model;       // null: splats of equal depth stay in the order of their slots
    const VisibleAnchor* visible; // anchors of the blocks, kDecodeBlock places for each
    const uint32_t* depth_bits;   // bits of view z of each slot
    const uint16_t* origins;      // origin of each slot's Gaussian, GaussianBlock::origin
    const uint32_t* counts;       // number of splats in each block
    uint32_t block_count;
    uint32_t block_capacity;
    // number of the group that each block holds, if blocks are groups; `visible` is then not read
    const uint32_t* groups = nullptr;
    uint32_t ordered_blocks = ~0u; // among equal depths, splats of blocks from here on come last, unordered
};

// Range [begin, end) of keys with equal depth.
struct SortRun {
    size_t begin, end;
};

struct SortScratch {
    Buffer<SortKey> keys[2];
    Buffer<uint32_t> histograms;
    Buffer<uint32_t> block_first;
    std::vector<std::vector<SortRun>> runs; // runs found in each chunk of keys; kept across frames for their memory
};

// Sorts the slots by depth; those of equal depth by the trainers' emission order (format facts, trap 28). The result
// lies in scratch.keys[0]; returns the number of keys.
size_t sortCpu(const SortArgs& args, const Workers& workers, SortScratch& scratch);

// Scalar reference: indices of `splats`, sorted by depth, then by `order`.
template <typename Real>
std::vector<uint32_t> sortReference(const std::vector<SplatOf<Real>>& splats);

} // namespace gsc
