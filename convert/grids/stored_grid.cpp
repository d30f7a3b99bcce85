// SPDX-License-Identifier: Apache-2.0
#include "convert/grids/stored_grid.h"

#include <gsc/error.h>
#include <gsc/gsc_issues.h>
#include <gsc/interrupt.h>

#include <algorithm>
#include <cinttypes>
#include <cmath>
#include <cstring>

namespace gsc {

namespace {

using Grid = StoredGrid::Grid;
using Leaf = StoredGrid::Leaf;
using Root = nanovdb::NanoRoot<nanovdb::ValueMask>;
using Upper = nanovdb::NanoUpper<nanovdb::ValueMask>;
using Lower = nanovdb::NanoLower<nanovdb::ValueMask>;
using TreeHead = nanovdb::TreeData<3>;

} // namespace

StoredGrid::StoredGrid(const GscView& view, uint32_t level_index, const IssueSink& sink)
    : m_view(view), m_level(view.levels[level_index]), m_level_index(level_index), m_sink(sink)
{
    const std::span<const std::byte> bytes = view.nanovdb.subspan(m_level.nanovdb_offset, m_level.nanovdb_bytes);
    m_bytes = bytes.size();
    m_data = bytes.data();
    // NanoVDB's structs need 32-byte alignment; a mapped file has it, a file in a plain buffer may not
    if (reinterpret_cast<uintptr_t>(m_data) % NANOVDB_DATA_ALIGNMENT != 0) {
        m_copy.resize(m_bytes / sizeof(Block) + 1);
        std::memcpy(m_copy.data(), m_data, m_bytes);
        m_data = reinterpret_cast<const std::byte*>(m_copy.data());
    }
    m_good = checkHead() && checkNodes();
}

void StoredGrid::report(uint16_t id, const std::string& detail) const
{
    uint64_t offset = m_level.nanovdb_offset;
    for (const SectionEntry& section : m_view.sections)
        if (section.type == kSectionNanoVdb)
            offset += section.offset;
    m_sink({&issueInfo(id), offset, formatString("/levels/%u/nanovdb", m_level_index), detail});
}

// Checks grid, tree and root, and that the nodes behind them fill the rest: the converter leaves no gaps between nodes.
bool StoredGrid::checkHead()
{
    if (m_bytes < Grid::memUsage() + sizeof(TreeHead) + sizeof(Root::DataType)) {
        report(issue::GridTree, formatString("%" PRIu64 " bytes are no grid", uint64_t(m_bytes)));
        return false;
    }
    const auto& grid = *reinterpret_cast<const nanovdb::GridData*>(m_data);
    constexpr uint32_t kBreadthFirst = uint32_t(nanovdb::GridFlags::IsBreadthFirst),
                       // a long name would lie outside the header, unchecked
        kLongName = uint32_t(nanovdb::GridFlags::HasLongGridName);
    if (grid.mMagic != NANOVDB_MAGIC_NUMBER || grid.mVersion.getMajor() != NANOVDB_MAJOR_VERSION_NUMBER ||
        grid.mGridType != nanovdb::GridType::Mask || !(grid.mFlags & kBreadthFirst) || (grid.mFlags & kLongName) != 0 ||
        std::memchr(grid.mGridName, 0, sizeof(grid.mGridName)) == nullptr || grid.mBlindMetadataCount != 0 ||
        grid.mGridSize != m_bytes) {
        report(issue::GridType,
               formatString("type %u, flags 0x%x, version %u, %" PRIu64 " bytes, expected type %u with "
                            "flag 0x%x, version %u and %" PRIu64 " bytes",
                            unsigned(grid.mGridType), grid.mFlags, grid.mVersion.getMajor(), grid.mGridSize,
                            unsigned(nanovdb::GridType::Mask), kBreadthFirst, unsigned(NANOVDB_MAJOR_VERSION_NUMBER),
                            uint64_t(m_bytes)));
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

// Returns true if each child of these nodes is the next node of its kind in the file, and no value of an inner node is
// active.
template <typename Node>
bool StoredGrid::checkChildren(uint64_t first, uint32_t count, uint64_t child_first, uint64_t child_bytes,
                               uint32_t child_count) const
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

bool StoredGrid::checkNodes() const
{
    const auto& tree = *reinterpret_cast<const TreeHead*>(m_data + Grid::memUsage());
    const auto& root = *reinterpret_cast<const Root::DataType*>(m_data + m_root);
    uint64_t next = 0;
    bool good = true;
    for (uint32_t i = 0; i < root.mTableSize && good; ++i)
        good = next < tree.mNodeCount[2] && uint64_t(root.tile(i)->child) == m_upper + next++ * sizeof(Upper) - m_root;
    good = good && next == tree.mNodeCount[2] &&
           checkChildren<Upper>(m_upper, tree.mNodeCount[2], m_lower, sizeof(Lower), tree.mNodeCount[1]) &&
           checkChildren<Lower>(m_lower, tree.mNodeCount[1], m_leaf, sizeof(Leaf), tree.mNodeCount[0]);
    if (!good)
        report(issue::GridTree, "a child is not the next node of its kind, or an inner node has an active tile");
    return good;
}

double quantaAt(const LevelRecord& level, PositionEncoding encoding, double coordinate)
{
    // where positions are integers, a position lies in the middle of a voxel of one quantum: round to the nearest
    const double quanta = (coordinate - double(level.origin)) / double(level.quantum);
    return std::floor(encoding == PositionEncoding::Grid ? quanta + 0.5 : quanta);
}

std::array<int32_t, 3> cellOf(const ChunkValues& anchors, const LevelRecord& level, uint32_t local)
{
    std::array<int32_t, 3> cell{};
    if (anchors.onGrid()) {
        cell = anchors.quanta(local);
    } else {
        const std::array<float, 3> position = anchors.position(local);
        for (size_t axis = 0; axis < 3; ++axis) {
            const double quanta = quantaAt(level, PositionEncoding::Float, double(position[axis]));
            cell[axis] = int32_t(std::max(-0x1p30, std::min(0x1p30, quanta))); // NaN becomes an end of the range
        }
    }
    for (int32_t& c : cell)
        c >>= level.cell_log2;
    return cell;
}

} // namespace gsc
