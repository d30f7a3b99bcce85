// SPDX-License-Identifier: Apache-2.0
// Grid positions of a chunk as a sorted set. The order of a chunk's anchors is that of their cells, and by source index in
// a cell: so positions need no order of their own, and a set of points takes fewer bits than a list of them.
#pragma once

#include <gsc/archive_layout.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gsc {

struct OrderedPositions { // positions of n anchors, in the order of (key, source)
    std::vector<uint64_t> keys;
    std::vector<uint16_t> flags;
    std::vector<uint32_t> sources;
};

[[nodiscard]] uint64_t positionKey(const uint16_t (&local)[3]);
[[nodiscard]] GridPosition keyPosition(uint64_t key); // without flags

// False if the anchors are not in the order of (key >> 3 cell_log2, source index), each pair once.
bool orderPositions(std::span<const GridPosition> positions, std::span<const uint32_t> sources, uint32_t cell_log2,
                    OrderedPositions& out);

// The anchors in their own order again. Precondition: equal numbers of keys, flags, sources and positions; keys ascend.
void restorePositions(const OrderedPositions& ordered, uint32_t cell_log2, std::span<GridPosition> positions,
                      std::span<uint32_t> sources);

} // namespace gsc
