// SPDX-License-Identifier: Apache-2.0
// Checks in NVDB the head of each level's grid. `gsc validate` checks the tree of the grid with NanoVDB's own reader.
#include "format/validate/gsc_validate.h"

#include <cstddef>

namespace gsc::validate {

namespace {

constexpr uint64_t kGridMagic = 0x304244566f6e614e; // "NanoVDB0" in ASCII, the first 8 bytes of a grid
constexpr uint32_t kGridMajor = 32;                 // version of NanoVDB's file format, that of OpenVDB 10.0
constexpr uint64_t kGridAlign = 32;
// byte offsets in nanovdb::GridData (672 bytes) and in the TreeData (64 bytes) behind it
constexpr uint64_t kGridVersionOffset = 16;
constexpr uint64_t kGridSizeOffset = 32;
constexpr uint64_t kLeafCountOffset = 672 + 32;
constexpr uint64_t kHeadBytes = 672 + 64;

} // namespace

void checkNanoVdb(Context& context)
{
    IssueLog& log = context.log;
    const ByteView section(context.view.nanovdb);
    const uint64_t at = context.offsetOf(kSectionNanoVdb);
    uint64_t end = 0;
    for (uint32_t i = 0; i < context.view.levels.size(); ++i) {
        const LevelRecord& level = context.view.levels[i];
        const uint64_t level_at = context.offsetOf(kSectionLevels) + i * sizeof(LevelRecord);
        const uint64_t expected = alignUp(end, kGridAlign);
        if (level.nanovdb_offset != expected || level.nanovdb_bytes < kHeadBytes ||
            !section.contains(level.nanovdb_offset, level.nanovdb_bytes)) {
            GSC_REPORT(log, GridRange, level_at + offsetof(LevelRecord, nanovdb_offset),
                       place("levels", i, "nanovdb_offset"), level.nanovdb_bytes, level.nanovdb_offset, kHeadBytes,
                       expected, section.size());
            return;
        }
        end = level.nanovdb_offset + level.nanovdb_bytes;

        const uint64_t magic = section.load<uint64_t>(level.nanovdb_offset).value();
        const uint32_t version = section.load<uint32_t>(level.nanovdb_offset + kGridVersionOffset).value();
        const uint64_t bytes = section.load<uint64_t>(level.nanovdb_offset + kGridSizeOffset).value();
        const uint32_t leaves = section.load<uint32_t>(level.nanovdb_offset + kLeafCountOffset).value();
        const uint64_t grid_at = at + level.nanovdb_offset;
        if (magic != kGridMagic)
            GSC_REPORT(log, GridMagic, grid_at, place("nanovdb", i, "magic"), magic, kGridMagic);
        if (version >> 21 != kGridMajor)
            GSC_REPORT(log, GridVersion, grid_at + kGridVersionOffset, place("nanovdb", i, "version"), version >> 21,
                       kGridMajor);
        if (bytes != level.nanovdb_bytes)
            GSC_REPORT(log, GridBytes, grid_at + kGridSizeOffset, place("nanovdb", i, "bytes"), bytes,
                       level.nanovdb_bytes);
        if (leaves != level.leaf_count)
            GSC_REPORT(log, GridLeaves, grid_at + kLeafCountOffset, place("nanovdb", i, "leaves"), leaves,
                       level.leaf_count);
    }
    if (end != section.size())
        GSC_REPORT(log, GridSectionBytes, at, "/nanovdb", section.size(), end);
}

} // namespace gsc::validate
