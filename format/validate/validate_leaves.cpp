// SPDX-License-Identifier: Apache-2.0
// Checks LEAF, the boxes of anchors, and INDX, the numbers of the anchors by source index.
#include "format/validate/gsc_validate.h"

#include <algorithm>
#include <cstddef>
#include <vector>

namespace gsc::validate {

namespace {

constexpr int64_t kLeafCells = 1 << kLeafLog2;
constexpr int64_t kChunkCells = 1 << kChunkLog2;

void checkLeafOrigin(Context& context, uint64_t i, const ChunkRecord& chunk, bool first_of_chunk, bool& good)
{
    IssueLog& log = context.log;
    const LeafRecord& leaf = context.view.leaves[i];
    const uint64_t at = context.offsetOf(kSectionLeaves) + i * sizeof(LeafRecord) + offsetof(LeafRecord, origin);
    const uint32_t cell_log2 = context.view.levels[chunk.level_index].cell_log2;
    for (uint32_t axis = 0; axis < 3; ++axis) {
        // exact, since the origin is a multiple of the divisor
        const int64_t low = chunk.origin[axis] / (int64_t(1) << cell_log2);
        const int64_t origin = leaf.origin[axis];
        if (origin % kLeafCells != 0 || origin < low || origin >= low + kChunkCells) {
            GSC_REPORT(log, LeafOrigin, at + 4 * axis, place("leaves", i, "origin"), axis, leaf.origin[axis], low,
                       low + kChunkCells - kLeafCells);
            good = false;
        }
    }
    if (first_of_chunk || mortonLess(context.view.leaves[i - 1].origin, leaf.origin))
        return;
    if (std::equal(std::begin(leaf.origin), std::end(leaf.origin), context.view.leaves[i - 1].origin))
        GSC_REPORT(log, LeafDuplicate, at, place("leaves", i, "origin"), leaf.origin[0], leaf.origin[1],
                   leaf.origin[2]);
    else
        GSC_REPORT(log, LeafOrder, at, place("leaves", i, "origin"), leaf.origin[0], leaf.origin[1], leaf.origin[2]);
}

void checkOrdinals(Context& context, const LevelRecord& level)
{
    IssueLog& log = context.log;
    std::vector<bool> seen(level.leaf_count); // memory is bounded: LEAF really holds that many records
    for (uint64_t i = level.leaf_first; i < level.leaf_first + level.leaf_count; ++i) {
        const uint32_t ordinal = context.view.leaves[i].nanovdb_index;
        const uint64_t at =
            context.offsetOf(kSectionLeaves) + i * sizeof(LeafRecord) + offsetof(LeafRecord, nanovdb_index);
        if (ordinal >= level.leaf_count) {
            GSC_REPORT(log, LeafNanoVdbRange, at, place("leaves", i, "nanovdb_index"), ordinal, level.leaf_count);
            continue;
        }
        if (seen[ordinal])
            GSC_REPORT(log, LeafNanoVdbDuplicate, at, place("leaves", i, "nanovdb_index"), ordinal);
        seen[ordinal] = true;
    }
}

} // namespace

bool checkLeaves(Context& context)
{
    IssueLog& log = context.log;
    bool good = true;
    for (uint32_t c = 0; c < context.view.chunks.size(); ++c) {
        const ChunkRecord& chunk = context.view.chunks[c];
        const uint64_t end = uint64_t(chunk.anchor_first) + chunk.anchor_count;
        uint64_t next = chunk.anchor_first;
        for (uint32_t j = 0; j < chunk.leaf_count; ++j) {
            const uint64_t i = uint64_t(chunk.leaf_first) + j;
            const LeafRecord& leaf = context.view.leaves[i];
            const uint64_t at = context.offsetOf(kSectionLeaves) + i * sizeof(LeafRecord);
            if (leaf.anchor_first != next || leaf.anchor_count < 1 || leaf.anchor_count > end - next) {
                GSC_REPORT(log, LeafAnchors, at + offsetof(LeafRecord, anchor_first),
                           place("leaves", i, "anchor_first"), leaf.anchor_first, leaf.anchor_count, next, end - next);
                return false;
            }
            next += leaf.anchor_count;
            checkLeafOrigin(context, i, chunk, j == 0, good);
        }
        if (next != end) {
            GSC_REPORT(log, LeafCover, context.offsetOf(kSectionChunks) + c * sizeof(ChunkRecord),
                       place("chunks", c, "leaf_count"), next, end);
            good = false;
        }
    }
    for (const LevelRecord& level : context.view.levels)
        checkOrdinals(context, level);
    return good;
}

void checkIndex(Context& context)
{
    IssueLog& log = context.log;
    const uint64_t anchors = context.view.header->anchor_count;
    const uint64_t at = context.offsetOf(kSectionIndex);
    const std::span<const uint32_t> index = context.view.index;
    std::vector<bool> seen(anchors); // memory is bounded: INDX really holds that many entries
    for (uint64_t i = 0; i < index.size(); ++i) {
        const uint32_t anchor = index[i];
        if (anchor >= anchors) {
            GSC_REPORT(log, IndexRange, at + 4 * i, place("index", i, ""), i, anchor, anchors);
            continue;
        }
        if (seen[anchor])
            GSC_REPORT(log, IndexDuplicate, at + 4 * i, place("index", i, ""), i, anchor);
        seen[anchor] = true;
    }
}

} // namespace gsc::validate
