// SPDX-License-Identifier: Apache-2.0
// The NanoVDB grid of a level as it lies in the file, checked so that it is safe to read.
#pragma once

#include "convert/survey/chunk_values.h"
#include <gsc/gsc_reader.h>

#include <nanovdb/NanoVDB.h>

#include <array>
#include <string>
#include <vector>

namespace gsc {

class StoredGrid {
public:
    using Grid = nanovdb::NanoGrid<nanovdb::ValueMask>;
    using Leaf = nanovdb::NanoLeaf<nanovdb::ValueMask>;

    // Checks the grid: no pointer in it is followed before it is known to stay inside the grid, and a fault is reported
    // to `sink`. Precondition: `view` came from openGsc() without errors; it must outlive this.
    StoredGrid(const GscView& view, uint32_t level_index, const IssueSink& sink);

    [[nodiscard]] const Grid* grid() const { return m_good ? reinterpret_cast<const Grid*>(m_data) : nullptr; }
    void report(uint16_t id, const std::string& detail) const;

private:
    struct alignas(NANOVDB_DATA_ALIGNMENT) Block {
        std::byte bytes[NANOVDB_DATA_ALIGNMENT];
    };
    bool checkHead();
    bool checkNodes() const;
    template <typename Node>
    bool checkChildren(uint64_t first, uint32_t count, uint64_t child_first, uint64_t child_bytes,
                       uint32_t child_count) const;

    const GscView& m_view;
    const LevelRecord& m_level;
    uint32_t m_level_index;
    const IssueSink& m_sink;
    const std::byte* m_data = nullptr;
    uint64_t m_bytes = 0;
    std::vector<Block> m_copy;
    // byte offsets of the first node of each kind in the grid
    uint64_t m_root = 0, m_upper = 0, m_lower = 0, m_leaf = 0;
    bool m_good = false;
};

// A coordinate in whole quanta of the level, rounded as its grid rounds. Between two voxels of float positions it
// belongs to the upper one.
double quantaAt(const LevelRecord& level, PositionEncoding encoding, double coordinate);

// The cell of an anchor in the grid of its level. `local`: number of the anchor in its chunk.
std::array<int32_t, 3> cellOf(const ChunkValues& anchors, const LevelRecord& level, uint32_t local);

} // namespace gsc
