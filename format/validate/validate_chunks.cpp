// SPDX-License-Identifier: Apache-2.0
// Checks CHNK and GRUP: ranges that cover the model without a gap, payloads that lie one behind the other, bounds.
#include "format/validate/gsc_validate.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace gsc::validate {

namespace {

// largest magnitude of an origin: with a 16-bit local position added, it stays far inside int32_t
constexpr int32_t kMaxOrigin = 1 << 30;

struct Running {
    uint64_t anchor, group, leaf; // first anchor, group and leaf that the next chunk must have
    uint64_t anchor_end, group_end, leaf_end;
};

// Reports a box that is not finite, whose low is above its high, or that is not inside the outer box (none if outer_low
// is null).
template <typename Report>
void checkBox(const float (&low)[3], const float (&high)[3], const float* outer_low, const float* outer_high,
              const Report& report)
{
    for (uint32_t axis = 0; axis < 3; ++axis) {
        const bool inside = !outer_low || (low[axis] >= outer_low[axis] && high[axis] <= outer_high[axis]);
        if (!orderedFinite(low[axis], high[axis]) || !inside)
            report(axis);
    }
}

bool finiteAtLeastZero(float value)
{
    return std::isfinite(value) && value >= 0;
}

bool checkChunkRanges(Context& context, uint64_t i, uint32_t level_index, Running& next)
{
    IssueLog& log = context.log;
    const ChunkRecord& chunk = context.view.chunks[i];
    const uint64_t at = context.offsetOf(kSectionChunks) + i * sizeof(ChunkRecord);
    const uint64_t before = log.errors();
    if (chunk.level_index != level_index)
        GSC_REPORT(log, ChunkLevel, at + offsetof(ChunkRecord, level_index), place("chunks", i, "level_index"),
                   chunk.level_index, level_index);
    if (chunk.anchor_first != next.anchor || chunk.anchor_count < 1 ||
        chunk.anchor_count > next.anchor_end - next.anchor) {
        GSC_REPORT(log, ChunkAnchors, at + offsetof(ChunkRecord, anchor_first), place("chunks", i, "anchor_first"),
                   chunk.anchor_first, chunk.anchor_count, next.anchor, next.anchor_end - next.anchor);
        return false;
    }
    const uint64_t groups = (uint64_t(chunk.anchor_count) + kGroupSize - 1) / kGroupSize;
    if (chunk.group_first != next.group || chunk.group_count != groups || groups > next.group_end - next.group) {
        GSC_REPORT(log, ChunkGroups, at + offsetof(ChunkRecord, group_first), place("chunks", i, "group_first"),
                   chunk.group_first, chunk.group_count, next.group, groups);
        return false;
    }
    if (chunk.leaf_first != next.leaf || chunk.leaf_count < 1 || chunk.leaf_count > next.leaf_end - next.leaf) {
        GSC_REPORT(log, ChunkLeaves, at + offsetof(ChunkRecord, leaf_first), place("chunks", i, "leaf_first"),
                   chunk.leaf_first, chunk.leaf_count, next.leaf, next.leaf_end - next.leaf);
        return false;
    }
    next.anchor += chunk.anchor_count;
    next.group += groups;
    next.leaf += chunk.leaf_count;
    return log.errors() == before;
}

// Checks the range and size of the payload of chunk `i`. `end`: end of the payload before it in ANCH, then of this one.
bool checkChunkPayload(Context& context, uint64_t i, uint64_t& end)
{
    IssueLog& log = context.log;
    const ChunkRecord& chunk = context.view.chunks[i];
    const uint64_t at = context.offsetOf(kSectionChunks) + i * sizeof(ChunkRecord);
    const uint64_t before = log.errors();
    const uint64_t bytes = chunkArrayLayout(*context.view.params, chunk.anchor_count).bytes;
    if (chunk.payload_bytes != bytes)
        GSC_REPORT(log, ChunkPayloadBytes, at + offsetof(ChunkRecord, payload_bytes),
                   place("chunks", i, "payload_bytes"), chunk.payload_bytes, bytes, chunk.anchor_count);
    if (chunk.payload_offset != alignUp(end, kPayloadAlign))
        GSC_REPORT(log, ChunkPayloadOffset, at + offsetof(ChunkRecord, payload_offset),
                   place("chunks", i, "payload_offset"), chunk.payload_offset, alignUp(end, kPayloadAlign));
    if (!ByteView(context.view.anchors).contains(chunk.payload_offset, chunk.payload_bytes))
        GSC_REPORT(log, ChunkPayloadRange, at + offsetof(ChunkRecord, payload_offset),
                   place("chunks", i, "payload_offset"), chunk.payload_bytes, chunk.payload_offset,
                   uint64_t(context.view.anchors.size()));
    if (log.errors() != before)
        return false;
    end = chunk.payload_offset + chunk.payload_bytes;
    return true;
}

bool checkChunkOrigin(Context& context, uint64_t i, bool first_of_level)
{
    IssueLog& log = context.log;
    const ChunkRecord& chunk = context.view.chunks[i];
    const int32_t span = 1 << (kChunkLog2 + context.view.levels[chunk.level_index].cell_log2);
    const uint64_t at = context.offsetOf(kSectionChunks) + i * sizeof(ChunkRecord) + offsetof(ChunkRecord, origin);
    bool good = true;
    for (uint32_t axis = 0; axis < 3; ++axis) {
        const int32_t origin = chunk.origin[axis];
        if (origin % span != 0 || origin < -kMaxOrigin || origin > kMaxOrigin) {
            GSC_REPORT(log, ChunkOrigin, at + 4 * axis, place("chunks", i, "origin"), axis, origin, span);
            good = false;
        }
    }
    if (first_of_level || mortonLess(context.view.chunks[i - 1].origin, chunk.origin))
        return good;
    if (std::equal(std::begin(chunk.origin), std::end(chunk.origin), context.view.chunks[i - 1].origin))
        GSC_REPORT(log, ChunkDuplicate, at, place("chunks", i, "origin"), chunk.level_index, chunk.origin[0],
                   chunk.origin[1], chunk.origin[2]);
    else
        GSC_REPORT(log, ChunkOrder, at, place("chunks", i, "origin"), chunk.origin[0], chunk.origin[1],
                   chunk.origin[2]);
    return good;
}

void checkChunkValues(Context& context, uint64_t i)
{
    IssueLog& log = context.log;
    const ChunkRecord& chunk = context.view.chunks[i];
    const LevelRecord& level = context.view.levels[chunk.level_index];
    const uint64_t at = context.offsetOf(kSectionChunks) + i * sizeof(ChunkRecord);
    checkBox(chunk.anchor_min, chunk.anchor_max, level.bounds_min, level.bounds_max, [&](uint32_t axis) {
        GSC_REPORT(log, ChunkBounds, at + offsetof(ChunkRecord, anchor_min) + 4 * axis,
                   place("chunks", i, "anchor_min"), "anchor", axis, double(chunk.anchor_min[axis]),
                   double(chunk.anchor_max[axis]));
    });
    checkBox(chunk.gaussian_min, chunk.gaussian_max, nullptr, nullptr, [&](uint32_t axis) {
        GSC_REPORT(log, ChunkBounds, at + offsetof(ChunkRecord, gaussian_min) + 4 * axis,
                   place("chunks", i, "gaussian_min"), "gaussian", axis, double(chunk.gaussian_min[axis]),
                   double(chunk.gaussian_max[axis]));
    });
    const auto value = [&](const char* name, size_t offset, float v, bool good, const char* expected) {
        if (!good)
            GSC_REPORT(log, ChunkValue, at + offset, place("chunks", i, name), name, double(v), expected);
    };
    value("anchor_sigma_max", offsetof(ChunkRecord, anchor_sigma_max), chunk.anchor_sigma_max,
          finiteAtLeastZero(chunk.anchor_sigma_max), "a finite value of 0 or more");
    value("gaussian_sigma_max", offsetof(ChunkRecord, gaussian_sigma_max), chunk.gaussian_sigma_max,
          finiteAtLeastZero(chunk.gaussian_sigma_max), "a finite value of 0 or more");
    value("extra_level_min", offsetof(ChunkRecord, extra_level_min), chunk.extra_level_min,
          orderedFinite(chunk.extra_level_min, chunk.extra_level_max), "a finite value up to extra_level_max");
    value("view_sensitivity", offsetof(ChunkRecord, view_sensitivity), chunk.view_sensitivity,
          finiteAtLeastZero(chunk.view_sensitivity), "a finite value of 0 or more");
    for (uint32_t k = 0; k < std::size(chunk.reserved); ++k)
        if (chunk.reserved[k] != 0)
            GSC_REPORT(log, ChunkReserved, at + offsetof(ChunkRecord, reserved) + 4 * k, place("chunks", i, "reserved"),
                       k, chunk.reserved[k]);
}

void checkGroupValues(Context& context, uint64_t i, const ChunkRecord& chunk)
{
    IssueLog& log = context.log;
    const GroupRecord& group = context.view.groups[i];
    const uint64_t at = context.offsetOf(kSectionGroups) + i * sizeof(GroupRecord);
    checkBox(group.anchor_min, group.anchor_max, chunk.anchor_min, chunk.anchor_max, [&](uint32_t axis) {
        GSC_REPORT(log, GroupBounds, at + offsetof(GroupRecord, anchor_min) + 4 * axis,
                   place("groups", i, "anchor_min"), "anchor", axis, double(group.anchor_min[axis]),
                   double(group.anchor_max[axis]));
    });
    checkBox(group.gaussian_min, group.gaussian_max, chunk.gaussian_min, chunk.gaussian_max, [&](uint32_t axis) {
        GSC_REPORT(log, GroupBounds, at + offsetof(GroupRecord, gaussian_min) + 4 * axis,
                   place("groups", i, "gaussian_min"), "gaussian", axis, double(group.gaussian_min[axis]),
                   double(group.gaussian_max[axis]));
    });
    const auto value = [&](const char* name, size_t offset, float v, bool good, const char* expected) {
        if (!good)
            GSC_REPORT(log, GroupValue, at + offset, place("groups", i, name), name, double(v), expected);
    };
    value("anchor_sigma_max", offsetof(GroupRecord, anchor_sigma_max), group.anchor_sigma_max,
          finiteAtLeastZero(group.anchor_sigma_max) && group.anchor_sigma_max <= chunk.anchor_sigma_max,
          "0 up to that of the chunk");
    value("gaussian_sigma_max", offsetof(GroupRecord, gaussian_sigma_max), group.gaussian_sigma_max,
          finiteAtLeastZero(group.gaussian_sigma_max) && group.gaussian_sigma_max <= chunk.gaussian_sigma_max,
          "0 up to that of the chunk");
    value("extra_level_min", offsetof(GroupRecord, extra_level_min), group.extra_level_min,
          orderedFinite(group.extra_level_min, group.extra_level_max) &&
              group.extra_level_min >= chunk.extra_level_min && group.extra_level_max <= chunk.extra_level_max,
          "a value up to extra_level_max, both inside the chunk's");
    value("view_sensitivity", offsetof(GroupRecord, view_sensitivity), group.view_sensitivity,
          finiteAtLeastZero(group.view_sensitivity), "a finite value of 0 or more");
}

void checkAnchorsEntry(Context& context, uint64_t payload_end)
{
    const SectionEntry& entry = *context.entry(kSectionAnchors);
    // the section may end with the last payload, or with the padding behind it
    if (entry.bytes != payload_end && entry.bytes != alignUp(payload_end, kPayloadAlign))
        GSC_REPORT(context.log, AnchorsBytes, entry.offset, "/sections/ANCH", entry.bytes, payload_end);
    checkAnchorsChecksum(context, entry);
}

} // namespace

bool checkChunks(Context& context)
{
    GscView& view = context.view;
    IssueLog& log = context.log;
    uint64_t payload_end = 0;
    uint64_t max_anchors = 0, max_bytes = 0;
    bool good = true;
    for (uint32_t li = 0; li < view.levels.size(); ++li) {
        const LevelRecord& level = view.levels[li];
        Running next{level.anchor_first,
                     level.group_first,
                     level.leaf_first,
                     level.anchor_first + level.anchor_count,
                     level.group_first + level.group_count,
                     level.leaf_first + level.leaf_count};
        for (uint64_t i = level.chunk_first; i < level.chunk_first + level.chunk_count; ++i) {
            // stops here, since later chunks' ranges depend on this one: one report says more than thousands
            if (!checkChunkRanges(context, i, li, next))
                return false;
            good &= checkChunkPayload(context, i, payload_end);
            good &= checkChunkOrigin(context, i, i == level.chunk_first);
            checkChunkValues(context, i);
            max_anchors = std::max<uint64_t>(max_anchors, view.chunks[i].anchor_count);
            max_bytes = std::max<uint64_t>(max_bytes, view.chunks[i].payload_bytes);
        }
        const auto cover = [&](const char* name, uint64_t value, uint64_t end) {
            if (value == end)
                return;
            GSC_REPORT(log, ChunkCover, context.offsetOf(kSectionChunks), place("levels", li, "chunk_count"), li, name,
                       value, end);
            good = false;
        };
        cover("anchor", next.anchor, next.anchor_end);
        cover("group", next.group, next.group_end);
        cover("leaf", next.leaf, next.leaf_end);
    }
    if (!good)
        return false;
    checkAnchorsEntry(context, payload_end);
    const uint64_t at = context.offsetOf(kSectionParams);
    if (view.params->max_chunk_anchors != max_anchors)
        GSC_REPORT(log, ParamMaxima, at + offsetof(ModelParams, max_chunk_anchors), "/params/max_chunk_anchors",
                   "max_chunk_anchors", uint64_t(view.params->max_chunk_anchors), max_anchors);
    if (view.params->max_chunk_bytes != max_bytes)
        GSC_REPORT(log, ParamMaxima, at + offsetof(ModelParams, max_chunk_bytes), "/params/max_chunk_bytes",
                   "max_chunk_bytes", view.params->max_chunk_bytes, max_bytes);
    return true;
}

bool checkGroups(Context& context)
{
    IssueLog& log = context.log;
    bool good = true;
    for (uint32_t c = 0; c < context.view.chunks.size(); ++c) {
        const ChunkRecord& chunk = context.view.chunks[c];
        for (uint32_t j = 0; j < chunk.group_count; ++j) {
            const uint64_t i = uint64_t(chunk.group_first) + j;
            const GroupRecord& group = context.view.groups[i];
            const uint64_t at = context.offsetOf(kSectionGroups) + i * sizeof(GroupRecord);
            const uint32_t first = chunk.anchor_first + j * kGroupSize;
            const uint32_t count = std::min(kGroupSize, chunk.anchor_count - j * kGroupSize);
            const uint64_t before = log.errors();
            if (group.chunk != c)
                GSC_REPORT(log, GroupChunk, at + offsetof(GroupRecord, chunk), place("groups", i, "chunk"), group.chunk,
                           c);
            if (group.anchor_first != first || group.anchor_count != count)
                GSC_REPORT(log, GroupAnchors, at + offsetof(GroupRecord, anchor_first),
                           place("groups", i, "anchor_first"), group.anchor_first, group.anchor_count, first, count);
            if (group.level_index != chunk.level_index)
                GSC_REPORT(log, GroupLevel, at + offsetof(GroupRecord, level_index), place("groups", i, "level_index"),
                           group.level_index, chunk.level_index);
            good &= log.errors() == before;
            checkGroupValues(context, i, chunk);
        }
    }
    return good;
}

} // namespace gsc::validate
