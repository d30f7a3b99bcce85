// SPDX-License-Identifier: Apache-2.0
// Grid positions of a chunk, stored as a sorted set. The anchors of a chunk are in the order of their cells, and in a
// cell by source index. That order can be found again, so it is not stored: a sorted set of points takes fewer bits
// than a list.
#pragma once

#include <gsc/archive_layout.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gsc {

struct OrderedPositions { // Morton keys, flags and source indices of n anchors, sorted by (key, source index)
    std::vector<uint64_t> keys;
    std::vector<uint16_t> flags;
    std::vector<uint32_t> sources;
};

[[nodiscard]] uint64_t positionKey(const uint16_t (&local)[3]);
[[nodiscard]] GridPosition keyPosition(uint64_t key); // position of a Morton key, its flags zero

// Fills `out`. Returns false if the anchors are not sorted by (key >> 3 cell_log2, source index), or if such a pair
// occurs twice.
bool orderPositions(std::span<const GridPosition> positions, std::span<const uint32_t> sources, uint32_t cell_log2,
                    OrderedPositions& out);

// Puts the anchors back into the order that they have in a chunk. Precondition: keys, flags, sources and positions are
// equally many; the keys ascend.
void restorePositions(const OrderedPositions& ordered, uint32_t cell_log2, std::span<GridPosition> positions,
                      std::span<uint32_t> sources);

} // namespace gsc
