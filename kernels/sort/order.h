// SPDX-License-Identifier: Apache-2.0
// The order cache: where in last frame's depth order a depth lay tells nearly where it lies in this one's.
#pragma once

#include "kernels/sort/sort.h"

#include <vector>

namespace gsc {

// Rank that a depth had in the last frame of one eye: known at every kStep-th splat of its order, and from those
// brought to a table over the bits of the depth that is interpolated. Whatever it holds, the sort is right.
class OrderCache {
public:
    static constexpr uint32_t kCellBits = 12;
    static constexpr uint32_t kCells = 1u << kCellBits;
    static constexpr uint32_t kStep = 128;        // splats per bucket, as long as there are
    static constexpr uint32_t kMaxBuckets = 4096; // fewer than that; then they hold more

    void clear() { m_buckets = 0; }
    [[nodiscard]] bool empty() const { return m_buckets == 0; }
    [[nodiscard]] uint32_t buckets() const { return m_buckets; }
    [[nodiscard]] uint64_t bytes() const { return m_ranks.capacity() * sizeof(uint32_t); }

    // Monotone in `depth_bits`; below buckets().
    [[nodiscard]] uint32_t bucket(uint32_t depth_bits) const
    {
        const uint32_t above = depth_bits > m_lowest ? depth_bits - m_lowest : 0;
        const uint32_t cell = above >> m_cell_shift;
        if (cell >= kCells)
            return m_buckets - 1;
        const uint32_t rank = m_ranks[cell], rise = m_ranks[cell + 1] - rank;
        return (rank + uint32_t(uint64_t(rise) * (above & ((1u << m_cell_shift) - 1)) >> m_cell_shift)) >> m_rank_shift;
    }

    // Remembers an order.
    void learn(const SortKey* keys, size_t count);

private:
    std::vector<uint32_t> m_ranks; // at the lower border of each cell of depth bits, and at the last one's upper one
    uint32_t m_lowest = 0, m_cell_shift = 0, m_rank_shift = 0, m_buckets = 0;
};

// As sortCpu(), from the order that `cache` remembers, and remembers this one. `moves` receives how many splats did
// not lie where the cache put them.
size_t sortFromOrder(const SortArgs& args, const Workers& workers, SortScratch& scratch, OrderCache& cache,
                     uint64_t& moves);

} // namespace gsc
