// SPDX-License-Identifier: Apache-2.0
#include "convert/grids/nanovdb_check.h"

#include "convert/grids/stored_grid.h"
#include <gsc/error.h>
#include <gsc/gsc_issues.h>
#include <gsc/interrupt.h>
#include "kernels/threads/tbb_bound.h"

#include <nanovdb/util/GridChecksum.h>

#include <cinttypes>
#include <map>

namespace gsc {

namespace {

using Grid = StoredGrid::Grid;
using Leaf = StoredGrid::Leaf;

constexpr int kMaxIssuesPerId = 16;

void checkLeaves(const GscView& view, const LevelRecord& level, const StoredGrid& stored)
{
    const Grid& grid = *stored.grid();
    const auto accessor = grid.getAccessor();
    const Leaf* first = grid.tree().getFirstNode<0>();
    uint64_t active = 0;
    for (uint64_t c = level.chunk_first; c < level.chunk_first + level.chunk_count; ++c) {
        throwIfInterrupted();
        const ChunkRecord& chunk = view.chunks[c];
        const ChunkValues anchors(view, chunk);
        for (uint32_t l = chunk.leaf_first; l < chunk.leaf_first + chunk.leaf_count; ++l) {
            const LeafRecord& record = view.leaves[l];
            const int32_t* o = record.origin;
            const Leaf* leaf = accessor.probeLeaf(nanovdb::Coord(o[0], o[1], o[2]));
            if (!leaf || leaf - first != ptrdiff_t(record.nanovdb_index) ||
                leaf->origin() != nanovdb::Coord(o[0], o[1], o[2])) {
                stored.report(issue::GridLeaf, formatString("leaf %u at cell %d %d %d, nanovdb_index %u", l, o[0], o[1],
                                                            o[2], record.nanovdb_index));
                continue;
            }
            nanovdb::Mask<3> cells(false);
            for (uint32_t a = 0; a < record.anchor_count; ++a) {
                const auto cell = cellOf(anchors, level, record.anchor_first - chunk.anchor_first + a);
                cells.setOn(Leaf::CoordToOffset(nanovdb::Coord(cell[0], cell[1], cell[2])));
            }
            active += cells.countOn();
            if (cells != leaf->valueMask())
                stored.report(issue::GridCells,
                              formatString("leaf %u at cell %d %d %d has %u active cells, its anchors occupy "
                                           "%u",
                                           l, o[0], o[1], o[2], leaf->valueMask().countOn(), cells.countOn()));
        }
    }
    if (grid.activeVoxelCount() != active)
        stored.report(issue::GridCells, formatString("the grid says %" PRIu64 " active cells, its leaves have %" PRIu64,
                                                     grid.activeVoxelCount(), active));
}

} // namespace

bool checkNanoVdb(const GscView& view, const IssueSink& sink)
{
    boundTbb();
    std::map<uint16_t, int> reported;
    const IssueSink some = [&](const Issue& issue) {
        if (reported[issue.info->id]++ < kMaxIssuesPerId)
            sink(issue);
    };
    for (uint32_t i = 0; i < view.levels.size(); ++i) {
        const StoredGrid stored(view, i, some);
        if (stored.grid() == nullptr)
            continue;
        const Grid& grid = *stored.grid();
        // note: tested first, because NanoVDB's own comparison accepts a grid without a checksum
        if (!nanovdb::GridChecksum(grid.checksum()).isFull() ||
            !nanovdb::validateChecksum(grid, nanovdb::ChecksumMode::Full))
            stored.report(issue::GridChecksum,
                          formatString("%016" PRIx64 " does not fit the content", grid.checksum()));
        checkLeaves(view, view.levels[i], stored);
    }
    return reported.empty();
}

} // namespace gsc
