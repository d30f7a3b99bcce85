// SPDX-License-Identifier: Apache-2.0
// Checks META, PARM and LEVL, small sections on which all other checks depend.
#include "format/validate/gsc_validate.h"
#include <gsc/utf8.h>

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace gsc::validate {

namespace {

constexpr uint32_t kKnownModelFlags = (kModelCompact << 1) - 1;

std::string param(const char* field)
{
    return formatString("/params/%s", field);
}

const char* flagConflict(uint32_t flags)
{
    if ((flags & (kModelBankDistance | kModelBankLevel)) && !(flags & kModelFeatureBank))
        return "inputs of a feature bank without a feature bank";
    if ((flags & kModelBankDistance) && (flags & kModelBankLevel))
        return "the feature bank takes the distance or the level, not both";
    if ((flags & (kModelLodHalfCell | kModelBankLevel)) && !(flags & kModelHasLevels))
        return "level options without levels";
    return nullptr;
}

void checkEnums(Context& context, const ModelParams& p, uint64_t at)
{
    IssueLog& log = context.log;
    if (p.family > uint32_t(ModelFamily::OctreeAnyGs))
        GSC_REPORT(log, ParamFamily, at + offsetof(ModelParams, family), param("family"), p.family,
                   unsigned(ModelFamily::OctreeAnyGs));
    if (p.flags & ~kKnownModelFlags)
        GSC_REPORT(log, ParamFlagBits, at + offsetof(ModelParams, flags), param("flags"), p.flags, kKnownModelFlags);
    if (const char* conflict = flagConflict(p.flags))
        GSC_REPORT(log, ParamFlagConflict, at + offsetof(ModelParams, flags), param("flags"), p.flags, conflict);
    const bool has_levels = p.flags & kModelHasLevels;
    if (p.level_rule > uint32_t(LevelRule::Progressive) || has_levels == (p.level_rule == uint32_t(LevelRule::None)))
        GSC_REPORT(log, ParamLevelRule, at + offsetof(ModelParams, level_rule), param("level_rule"), p.level_rule,
                   has_levels ? "1..4 with levels" : "0 without levels");
    if (p.position_encoding > uint32_t(PositionEncoding::Float))
        GSC_REPORT(log, ParamPositionEncoding, at + offsetof(ModelParams, position_encoding),
                   param("position_encoding"), p.position_encoding);
    if (p.raster_rules > uint32_t(RasterRules::Gsplat))
        GSC_REPORT(log, ParamRasterRules, at + offsetof(ModelParams, raster_rules), param("raster_rules"),
                   p.raster_rules);
    if (p.chunk_payload_version != 1)
        GSC_REPORT(log, ParamPayloadVersion, at + offsetof(ModelParams, chunk_payload_version),
                   param("chunk_payload_version"), p.chunk_payload_version);
}

void checkCounts(Context& context, const ModelParams& p, uint64_t at)
{
    IssueLog& log = context.log;
    const bool has_levels = p.flags & kModelHasLevels;
    const bool has_bank = p.flags & kModelFeatureBank;
    if (p.feat_dim < 1 || p.feat_dim > kMaxFeatDim || (has_bank && p.feat_dim % 4 != 0))
        GSC_REPORT(log, ParamFeatDim, at + offsetof(ModelParams, feat_dim), param("feat_dim"), p.feat_dim,
                   has_bank ? "a multiple of 4 in 4..1024" : "1..1024");
    if (p.n_offsets < 1 || p.n_offsets > kMaxOffsets)
        GSC_REPORT(log, ParamOffsetCount, at + offsetof(ModelParams, n_offsets), param("n_offsets"), p.n_offsets,
                   kMaxOffsets);
    if (p.appearance_dim > kMaxAppearanceDim || (p.appearance_dim == 0) != (p.appearance_rows == 0))
        GSC_REPORT(log, ParamAppearance, at + offsetof(ModelParams, appearance_dim), param("appearance_dim"),
                   p.appearance_dim, p.appearance_rows, kMaxAppearanceDim);
    const uint32_t fork_min = has_levels ? 2 : 0; // with levels at least 2: the rule of levels divides by log2(fork)
    if (p.fork < fork_min || p.fork > kMaxFork)
        GSC_REPORT(log, ParamFork, at + offsetof(ModelParams, fork), param("fork"), p.fork, fork_min, kMaxFork);
    if (p.level_count < 1 || p.level_count > kMaxLevels || (!has_levels && p.level_count != 1))
        GSC_REPORT(log, ParamLevels, at + offsetof(ModelParams, level_count), param("level_count"), p.level_count,
                   has_levels ? "1..64" : "1 without levels");
    if (p.level_clamp < 0 || p.level_clamp > kMaxLevelValue)
        GSC_REPORT(log, ParamLevelClamp, at + offsetof(ModelParams, level_clamp), param("level_clamp"), p.level_clamp,
                   kMaxLevelValue);
    const uint32_t mlp_count = has_bank ? 4 : 3;
    if (p.mlp_count != mlp_count)
        GSC_REPORT(log, ParamMlpCount, at + offsetof(ModelParams, mlp_count), param("mlp_count"), p.mlp_count,
                   mlp_count);

    const uint64_t anchors = context.view.header->anchor_count;
    const auto total = [&](const char* name, size_t offset, uint64_t value) {
        if (value < 1 || value > anchors)
            GSC_REPORT(log, ParamTotals, at + offset, param(name), name, value, anchors);
    };
    total("chunk_count", offsetof(ModelParams, chunk_count), p.chunk_count);
    total("group_count", offsetof(ModelParams, group_count), p.group_count);
    total("leaf_count", offsetof(ModelParams, leaf_count), p.leaf_count);
}

void checkValues(Context& context, const ModelParams& p, uint64_t at)
{
    IssueLog& log = context.log;
    const bool has_levels = p.flags & kModelHasLevels;
    const bool has_grid = p.position_encoding == uint32_t(PositionEncoding::Grid);
    const auto value = [&](const char* name, size_t offset, float v, bool in_range, const char* expected) {
        if (!std::isfinite(v) || !in_range)
            GSC_REPORT(log, ParamValue, at + offset, param(name), name, double(v), expected);
    };
    value("standard_dist", offsetof(ModelParams, standard_dist), p.standard_dist,
          has_levels ? p.standard_dist > 0 : p.standard_dist >= 0, has_levels ? "above 0 with levels" : "0 or more");
    value("voxel_size", offsetof(ModelParams, voxel_size), p.voxel_size,
          has_grid ? p.voxel_size > 0 : p.voxel_size >= 0, has_grid ? "above 0 with grid positions" : "0 or more");
    value("grid_origin", offsetof(ModelParams, grid_origin), p.grid_origin, true, "a finite value");
    value("near_z", offsetof(ModelParams, near_z), p.near_z, p.near_z >= 0, "0 or more");
    value("lod_scale", offsetof(ModelParams, lod_scale), p.lod_scale, p.lod_scale > 0, "above 0");
    value("constant_opacity", offsetof(ModelParams, constant_opacity), p.constant_opacity, true, "a finite value");
    for (int i = 0; i < 4; ++i)
        value("constant_rotation", offsetof(ModelParams, constant_rotation) + 4 * i, p.constant_rotation[i], true,
              "finite values");
    for (uint32_t axis = 0; axis < 3; ++axis)
        if (!orderedFinite(p.bounds_min[axis], p.bounds_max[axis]))
            GSC_REPORT(log, ParamBounds, at + offsetof(ModelParams, bounds_min) + 4 * axis, param("bounds_min"), axis,
                       double(p.bounds_min[axis]), double(p.bounds_max[axis]));
    if (p.reserved0 != 0)
        GSC_REPORT(log, ParamReserved, at + offsetof(ModelParams, reserved0), param("reserved0"), 0u, p.reserved0);
    for (uint32_t i = 0; i < std::size(p.reserved); ++i)
        if (p.reserved[i] != 0)
            GSC_REPORT(log, ParamReserved, at + offsetof(ModelParams, reserved) + 4 * i, param("reserved"), i,
                       p.reserved[i]);
}

// Checks one level without regard to the others.
void checkLevel(Context& context, const LevelRecord& level, uint32_t index, uint64_t at)
{
    IssueLog& log = context.log;
    const ModelParams& p = *context.view.params;
    const bool has_levels = p.flags & kModelHasLevels;
    const bool in_range = level.level >= -kMaxLevelValue && level.level <= kMaxLevelValue;
    if (!in_range || (!has_levels && level.level != 0) || (index == 0 && level.level != p.level_min))
        GSC_REPORT(log, LevelValue, at + offsetof(LevelRecord, level), place("levels", index, "level"), level.level,
                   !has_levels  ? "0 without levels"
                   : index == 0 ? "level_min first"
                                : "-1024..1024");
    if (index > 0 && level.level <= context.view.levels[index - 1].level)
        GSC_REPORT(log, LevelOrder, at + offsetof(LevelRecord, level), place("levels", index, "level"), level.level,
                   context.view.levels[index - 1].level);
    if (level.cell_log2 > kMaxCellLog2)
        GSC_REPORT(log, LevelCell, at + offsetof(LevelRecord, cell_log2), place("levels", index, "cell_log2"),
                   level.cell_log2, kMaxCellLog2);

    // allows a few ulps: v_L is one fp32 rounding of a quotient, whose own roundings depend on the trainer
    const double quotient = double(p.voxel_size) / std::pow(double(std::max(p.fork, 1u)), level.level);
    const bool has_grid = p.position_encoding == uint32_t(PositionEncoding::Grid);
    const bool positive = std::isfinite(level.quantum) && level.quantum > 0;
    if (!positive || (has_grid && !(std::fabs(level.quantum - quotient) <= 1e-6 * quotient)))
        GSC_REPORT(log, LevelQuantum, at + offsetof(LevelRecord, quantum), place("levels", index, "quantum"),
                   double(level.quantum), has_grid ? "about " : "above ", has_grid ? quotient : 0.0);
    if (!(level.origin == p.grid_origin))
        GSC_REPORT(log, LevelOrigin, at + offsetof(LevelRecord, origin), place("levels", index, "origin"),
                   double(level.origin), double(p.grid_origin));
    for (uint32_t axis = 0; axis < 3; ++axis) {
        const float low = level.bounds_min[axis], high = level.bounds_max[axis];
        if (!orderedFinite(low, high) || !(low >= p.bounds_min[axis] && high <= p.bounds_max[axis]))
            GSC_REPORT(log, LevelBounds, at + offsetof(LevelRecord, bounds_min) + 4 * axis,
                       place("levels", index, "bounds_min"), axis, double(low), double(high),
                       double(p.bounds_min[axis]), double(p.bounds_max[axis]));
    }
    if (level.reserved != 0)
        GSC_REPORT(log, LevelReserved, at + offsetof(LevelRecord, reserved), place("levels", index, "reserved"),
                   level.reserved);
}

} // namespace

void checkManifest(Context& context)
{
    const SectionEntry& entry = *context.entry(kSectionMeta);
    const std::span<const std::byte> bytes = context.content(entry);
    const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    context.view.manifest = text;
    // note: `gsc validate` parses the JSON itself; this check makes sure that every reader gets text
    const size_t good = utf8Prefix(text);
    const size_t control = size_t(std::find_if(text.begin(), text.end(),
                                               [](char c) {
                                                   const uint8_t u = uint8_t(c);
                                                   return u < 0x20 && c != '\n' && c != '\t' && c != '\r';
                                               }) -
                                  text.begin());
    const char* const space = " \n\t\r";
    const size_t first = text.find_first_not_of(space), last = text.find_last_not_of(space);
    if (good != text.size())
        GSC_REPORT(context.log, ManifestText, entry.offset + good, "/meta", "is not UTF-8", uint64_t(good));
    else if (control != text.size())
        GSC_REPORT(context.log, ManifestText, entry.offset + control, "/meta", "has a control character",
                   uint64_t(control));
    else if (first == text.npos || text[first] != '{' || text[last] != '}')
        GSC_REPORT(context.log, ManifestText, entry.offset, "/meta", "is not an object", uint64_t(0));
}

bool checkParams(Context& context)
{
    const SectionEntry& entry = *context.entry(kSectionParams);
    IssueLog& log = context.log;
    if (entry.count != 1)
        GSC_REPORT(log, SectionCount, entry.offset, "/params", "PARM", entry.count, uint64_t(1));
    if (entry.bytes != sizeof(ModelParams))
        GSC_REPORT(log, SectionBytes, entry.offset, "/params", "PARM", entry.bytes, entry.count,
                   uint64_t(sizeof(ModelParams)), "");
    const auto records = context.file.array<ModelParams>(entry.offset, 1);
    if (log.fatal() || !records)
        return false;
    const ModelParams& p = records->front();
    context.view.params = &p;
    checkEnums(context, p, entry.offset);
    checkCounts(context, p, entry.offset);
    checkValues(context, p, entry.offset);
    return !log.fatal();
}

bool checkLevels(Context& context)
{
    const SectionEntry& entry = *context.entry(kSectionLevels);
    const ModelParams& p = *context.view.params;
    IssueLog& log = context.log;
    if (entry.count != p.level_count)
        GSC_REPORT(log, SectionCount, entry.offset, "/levels", "LEVL", entry.count, uint64_t(p.level_count));
    if (entry.bytes != p.level_count * sizeof(LevelRecord))
        GSC_REPORT(log, SectionBytes, entry.offset, "/levels", "LEVL", entry.bytes, entry.count,
                   uint64_t(p.level_count * sizeof(LevelRecord)), "");
    const auto records = context.file.array<LevelRecord>(entry.offset, p.level_count);
    if (log.fatal() || !records)
        return false;
    context.view.levels = *records;

    struct Running {
        const char* name;
        uint64_t LevelRecord::*first;
        uint64_t LevelRecord::*count;
        uint64_t total;
        uint64_t next = 0;
    };
    Running running[] = {
        {"anchors", &LevelRecord::anchor_first, &LevelRecord::anchor_count, context.view.header->anchor_count},
        {"chunks", &LevelRecord::chunk_first, &LevelRecord::chunk_count, p.chunk_count},
        {"groups", &LevelRecord::group_first, &LevelRecord::group_count, p.group_count},
        {"leaves", &LevelRecord::leaf_first, &LevelRecord::leaf_count, p.leaf_count},
    };
    for (uint32_t i = 0; i < records->size(); ++i) {
        const LevelRecord& level = (*records)[i];
        const uint64_t at = entry.offset + i * sizeof(LevelRecord);
        checkLevel(context, level, i, at);
        for (Running& r : running) {
            const uint64_t first = level.*r.first, count = level.*r.count;
            if (first != r.next || count < 1 || count > r.total - r.next) {
                GSC_REPORT(log, LevelRange, at + offsetof(LevelRecord, anchor_first), place("levels", i, r.name),
                           r.name, first, count, r.next, r.total - r.next);
                return false;
            }
            r.next += count;
        }
    }
    for (const Running& r : running)
        if (r.next != r.total)
            GSC_REPORT(log, LevelCover, entry.offset, "/levels", r.next, r.name, r.total);
    return !log.fatal();
}

} // namespace gsc::validate
