// SPDX-License-Identifier: Apache-2.0
#include "format/archive/ordered_positions.h"

#include "format/numbers/morton.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace gsc {

uint64_t positionKey(const uint16_t (&local)[3])
{
    return mortonEncode(local[0], local[1], local[2]);
}

GridPosition keyPosition(uint64_t key)
{
    return {{uint16_t(gatherBits3(key)), uint16_t(gatherBits3(key >> 1)), uint16_t(gatherBits3(key >> 2))}, 0};
}

bool orderPositions(std::span<const GridPosition> positions, std::span<const uint32_t> sources, uint32_t cell_log2,
                    OrderedPositions& out)
{
    const size_t n = positions.size();
    std::vector<uint64_t> keys(n);
    for (size_t i = 0; i < n; ++i)
        keys[i] = positionKey(positions[i].local);
    const uint32_t shift = 3 * cell_log2;
    for (size_t i = 1; i < n; ++i)
        if (std::pair(keys[i - 1] >> shift, sources[i - 1]) >= std::pair(keys[i] >> shift, sources[i]))
            return false;
    std::vector<uint32_t> order(n);
    std::iota(order.begin(), order.end(), 0u);
    std::ranges::sort(order, {}, [&](uint32_t i) { return std::pair(keys[i], sources[i]); });
    out.keys.resize(n);
    out.flags.resize(n);
    out.sources.resize(n);
    for (size_t i = 0; i < n; ++i) {
        out.keys[i] = keys[order[i]];
        out.flags[i] = positions[order[i]].flags;
        out.sources[i] = sources[order[i]];
    }
    return true;
}

void restorePositions(const OrderedPositions& ordered, uint32_t cell_log2, std::span<GridPosition> positions,
                      std::span<uint32_t> sources)
{
    const size_t n = positions.size();
    const uint32_t shift = 3 * cell_log2;
    // anchors of one cell: source index, place in the order of the keys
    std::vector<std::pair<uint32_t, uint32_t>> cell;
    for (size_t first = 0, last; first < n; first = last) {
        for (last = first + 1; last < n && ordered.keys[last] >> shift == ordered.keys[first] >> shift;)
            ++last;
        cell.clear();
        for (size_t i = first; i < last; ++i)
            cell.emplace_back(ordered.sources[i], uint32_t(i));
        if (cell.size() > 1)
            std::ranges::sort(cell);
        for (size_t i = first; i < last; ++i) {
            const auto [source, place] = cell[i - first];
            positions[i] = keyPosition(ordered.keys[place]);
            positions[i].flags = ordered.flags[place];
            sources[i] = source;
        }
    }
}

} // namespace gsc
