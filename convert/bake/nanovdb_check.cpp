// SPDX-License-Identifier: Apache-2.0
#include "convert/bake/nanovdb_check.h"

#include "format/error.h"
#include "format/gsc_issues.h"
#include "format/interrupt.h"

#include <nanovdb/util/GridChecksum.h>

#include <algorithm>
#include <cinttypes>
#include <cmath>
#include <cstring>
#include <map>
#include <vector>

namespace gsc {

namespace {

using Grid = nanovdb::NanoGrid<nanovdb::ValueMask>;
using Root = nanovdb::NanoRoot<nanovdb::ValueMask>;
using Upper = nanovdb::NanoUpper<nanovdb::ValueMask>;
using Lower = nanovdb::NanoLower<nanovdb::ValueMask>;
using Leaf = nanovdb::NanoLeaf<nanovdb::ValueMask>;
using TreeHead = nanovdb::TreeData<3>;

constexpr int kMaxIssuesPerId = 16;

class GridCheck {
public:
    GridCheck(const GscView& view, uint32_t level_index, const IssueSink& sink, std::map<uint16_t, int>& reported)
        : m_view(view), m_level(view.levels[level_index]), m_level_index(level_index), m_sink(sink),
          m_reported(reported)
    {
        const std::span<const std::byte> bytes = view.nanovdb.subspan(m_level.nanovdb_offset, m_level.nanovdb_bytes);
        m_bytes = bytes.size();
        m_data = bytes.data();
        // NanoVDB's structs want 32; a mapping has it, a file in a plain buffer may not
        if (reinterpret_cast<uintptr_t>(m_data) % NANOVDB_DATA_ALIGNMENT != 0) {
            m_copy.resize(m_bytes / sizeof(Block) + 1);
            std::memcpy(m_copy.data(), m_data, m_bytes);
            m_data = reinterpret_cast<const std::byte*>(m_copy.data());
        }
    }

    void run()
    {
        if (!checkHead() || !checkNodes())
            return;
        const Grid& grid = *reinterpret_cast<const Grid*>(m_data);
        // note: a grid without a checksum would pass NanoVDB's own comparison
        if (!nanovdb::GridChecksum(grid.checksum()).isFull() ||
            !nanovdb::validateChecksum(grid, nanovdb::ChecksumMode::Full))
            report(issue::GridChecksum, formatString("%016" PRIx64 " does not fit the content", grid.checksum()));
        checkLeaves(grid);
    }

private:
    struct alignas(NANOVDB_DATA_ALIGNMENT) Block {
        std::byte bytes[NANOVDB_DATA_ALIGNMENT];
    };

    void report(uint16_t id, const std::string& detail)
    {
        if (m_reported[id]++ >= kMaxIssuesPerId)
            return;
        const std::span<const IssueInfo> all = allIssues();
        const IssueInfo* info = &*std::find_if(all.begin(), all.end(), [&](const IssueInfo& i) { return i.id == id; });
        uint64_t offset = m_level.nanovdb_offset;
        for (const SectionEntry& section : m_view.sections)
            if (section.type == kSectionNanoVdb)
                offset += section.offset;
        m_sink({info, offset, formatString("/levels/%u/nanovdb", m_level_index), detail});
    }

    // Grid, tree and root, and the sizes of everything after them: the converter packs nodes without gaps.
    bool checkHead()
    {
        if (m_bytes < Grid::memUsage() + sizeof(TreeHead) + sizeof(Root::DataType)) {
            report(issue::GridTree, formatString("%" PRIu64 " bytes are no grid", uint64_t(m_bytes)));
            return false;
        }
        const auto& grid = *reinterpret_cast<const nanovdb::GridData*>(m_data);
        constexpr uint32_t kBreadthFirst = uint32_t(nanovdb::GridFlags::IsBreadthFirst);
        if (grid.mMagic != NANOVDB_MAGIC_NUMBER || grid.mVersion.getMajor() != NANOVDB_MAJOR_VERSION_NUMBER ||
            grid.mGridType != nanovdb::GridType::Mask || !(grid.mFlags & kBreadthFirst) ||
            grid.mBlindMetadataCount != 0 || grid.mGridSize != m_bytes) {
            report(issue::GridType,
                   formatString("type %u, flags 0x%x, version %u, %" PRIu64 " bytes, expected type %u with "
                                "flag 0x%x, version %u and %" PRIu64 " bytes",
                                unsigned(grid.mGridType), grid.mFlags, grid.mVersion.getMajor(), grid.mGridSize,
                                unsigned(nanovdb::GridType::Mask), kBreadthFirst,
                                unsigned(NANOVDB_MAJOR_VERSION_NUMBER), uint64_t(m_bytes)));
            return false;
        }
        const auto& tree = *reinterpret_cast<const TreeHead*>(m_data + Grid::memUsage());
        const auto& root = *reinterpret_cast<const Root::DataType*>(m_data + Grid::memUsage() + sizeof(TreeHead));
        m_root = Grid::memUsage() + sizeof(TreeHead);
        m_upper = m_root + sizeof(Root::DataType) + uint64_t(root.mTableSize) * sizeof(Root::DataType::Tile);
        m_lower = m_upper + uint64_t(tree.mNodeCount[2]) * sizeof(Upper);
        m_leaf = m_lower + uint64_t(tree.mNodeCount[1]) * sizeof(Lower);
        const uint64_t end = m_leaf + uint64_t(tree.mNodeCount[0]) * sizeof(Leaf);
        const uint64_t expected[4] = {m_leaf, m_lower, m_upper, m_root};
        bool good = end == m_bytes && tree.mNodeCount[0] == m_level.leaf_count;
        for (int i = 0; i < 4; ++i)
            good = good && tree.mNodeOffset[i] == expected[i] - Grid::memUsage();
        if (!good)
            report(issue::GridTree, formatString("%u leaves, %u lower and %u upper nodes do not fill %" PRIu64
                                                 " bytes, or the level has not %" PRIu64 " leaves",
                                                 tree.mNodeCount[0], tree.mNodeCount[1], tree.mNodeCount[2],
                                                 uint64_t(m_bytes), m_level.leaf_count));
        return good;
    }

    // Children are numbered through in the order their parents name them; nothing but leaves is active.
    template <typename Node>
    bool checkChildren(uint64_t first, uint32_t count, uint64_t child_first, uint64_t child_bytes, uint32_t child_count)
    {
        uint64_t next = 0;
        for (uint32_t n = 0; n < count; ++n) {
            throwIfInterrupted();
            const uint64_t at = first + n * sizeof(Node);
            const auto& node = *reinterpret_cast<const typename Node::DataType*>(m_data + at);
            if (!node.mValueMask.isOff())
                return false;
            for (auto i = node.mChildMask.beginOn(); i; ++i)
                if (next == child_count || uint64_t(node.mTable[*i].child) != child_first + next++ * child_bytes - at)
                    return false;
        }
        return next == child_count;
    }

    bool checkNodes()
    {
        const auto& tree = *reinterpret_cast<const TreeHead*>(m_data + Grid::memUsage());
        const auto& root = *reinterpret_cast<const Root::DataType*>(m_data + m_root);
        uint64_t next = 0;
        bool good = true;
        for (uint32_t i = 0; i < root.mTableSize && good; ++i)
            good =
                next < tree.mNodeCount[2] && uint64_t(root.tile(i)->child) == m_upper + next++ * sizeof(Upper) - m_root;
        good = good && next == tree.mNodeCount[2] &&
               checkChildren<Upper>(m_upper, tree.mNodeCount[2], m_lower, sizeof(Lower), tree.mNodeCount[1]) &&
               checkChildren<Lower>(m_lower, tree.mNodeCount[1], m_leaf, sizeof(Leaf), tree.mNodeCount[0]);
        if (!good)
            report(issue::GridTree, "a child is not the next node of its kind, or an inner node has an active tile");
        return good;
    }

    // Cell of an anchor, in cells of the level; the chunk must own the anchor.
    void cellOf(const ChunkRecord& chunk, const std::byte* position, int32_t cell[3]) const
    {
        if (m_view.params->position_encoding == uint32_t(PositionEncoding::Grid)) {
            GridPosition local;
            std::memcpy(&local, position, sizeof(local));
            for (int axis = 0; axis < 3; ++axis)
                cell[axis] = (chunk.origin[axis] + int32_t(local.local[axis])) >> m_level.cell_log2;
            return;
        }
        float world[3];
        std::memcpy(world, position, sizeof(world));
        for (int axis = 0; axis < 3; ++axis) {
            const double quanta = std::floor((double(world[axis]) - double(m_level.origin)) / double(m_level.quantum));
            cell[axis] = int32_t(std::clamp(quanta, -0x1p30, 0x1p30)) >> m_level.cell_log2;
        }
    }

    void checkLeaves(const Grid& grid)
    {
        const auto accessor = grid.getAccessor();
        const Leaf* first = grid.tree().getFirstNode<0>();
        uint64_t active = 0;
        for (uint64_t c = m_level.chunk_first; c < m_level.chunk_first + m_level.chunk_count; ++c) {
            throwIfInterrupted();
            const ChunkRecord& chunk = m_view.chunks[c];
            const ChunkArrayLayout layout = chunkArrayLayout(*m_view.params, chunk.anchor_count);
            const std::byte* positions =
                chunkPayload(m_view, chunk).data() + layout.offset[uint32_t(ChunkArray::Position)];
            for (uint32_t l = chunk.leaf_first; l < chunk.leaf_first + chunk.leaf_count; ++l) {
                const LeafRecord& record = m_view.leaves[l];
                const int32_t* o = record.origin;
                const Leaf* leaf = accessor.probeLeaf(nanovdb::Coord(o[0], o[1], o[2]));
                if (!leaf || leaf - first != ptrdiff_t(record.nanovdb_index) ||
                    leaf->origin() != nanovdb::Coord(o[0], o[1], o[2])) {
                    report(issue::GridLeaf, formatString("leaf %u at cell %d %d %d, nanovdb_index %u", l, o[0], o[1],
                                                         o[2], record.nanovdb_index));
                    continue;
                }
                nanovdb::Mask<3> cells(false);
                for (uint32_t a = 0; a < record.anchor_count; ++a) {
                    int32_t cell[3];
                    cellOf(chunk,
                           positions + layout.stride[uint32_t(ChunkArray::Position)] *
                                           (record.anchor_first - chunk.anchor_first + a),
                           cell);
                    cells.setOn(Leaf::CoordToOffset(nanovdb::Coord(cell[0], cell[1], cell[2])));
                }
                active += cells.countOn();
                if (cells != leaf->valueMask())
                    report(issue::GridCells,
                           formatString("leaf %u at cell %d %d %d has %u active cells, its anchors occupy "
                                        "%u",
                                        l, o[0], o[1], o[2], leaf->valueMask().countOn(), cells.countOn()));
            }
        }
        if (grid.activeVoxelCount() != active)
            report(issue::GridCells, formatString("the grid says %" PRIu64 " active cells, its leaves have %" PRIu64,
                                                  grid.activeVoxelCount(), active));
    }

    const GscView& m_view;
    const LevelRecord& m_level;
    uint32_t m_level_index;
    const IssueSink& m_sink;
    std::map<uint16_t, int>& m_reported;
    const std::byte* m_data = nullptr;
    uint64_t m_bytes = 0;
    std::vector<Block> m_copy;
    uint64_t m_root = 0, m_upper = 0, m_lower = 0, m_leaf = 0; // offsets of the first node of each kind
};

} // namespace

bool checkNanoVdb(const GscView& view, const IssueSink& sink)
{
    std::map<uint16_t, int> reported;
    for (uint32_t i = 0; i < view.levels.size(); ++i)
        GridCheck(view, i, sink, reported).run();
    return reported.empty();
}

} // namespace gsc
