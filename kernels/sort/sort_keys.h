// SPDX-License-Identifier: Apache-2.0
// What the two ways to sort on a CPU share.
#pragma once

#include "kernels/sort/sort.h"

namespace gsc {

// Place of a slot among those of equal depth.
uint64_t orderOfSlot(const SortArgs& args, uint32_t slot);

// Fills scratch.block_first with the running sum of the blocks' counts and makes room for the keys; returns the sum.
size_t placeBlocks(const SortArgs& args, SortScratch& scratch);

} // namespace gsc
