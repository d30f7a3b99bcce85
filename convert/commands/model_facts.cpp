// SPDX-License-Identifier: Apache-2.0
#include "convert/commands/model_facts.h"

#include "convert/input/checkpoint.h"

namespace gsc {

const char* familyName(uint32_t family)
{
    switch (ModelFamily(family)) {
    case ModelFamily::ScaffoldGs:
        return "scaffold-gs";
    case ModelFamily::ScaffoldGsV1:
        return "scaffold-gs-v1";
    case ModelFamily::OctreeGs:
        return "octree-gs";
    case ModelFamily::OctreeAnyGs:
        return "octree-anygs";
    }
    return "unknown";
}

const char* levelRuleName(uint32_t rule)
{
    switch (LevelRule(rule)) {
    case LevelRule::None:
        return "none";
    case LevelRule::Floor:
        return "floor";
    case LevelRule::Round:
        return "round";
    case LevelRule::Ceil:
        return "ceil";
    case LevelRule::Progressive:
        return "progressive";
    }
    return "unknown";
}

const char* rasterRulesName(uint32_t rules)
{
    switch (RasterRules(rules)) {
    case RasterRules::DiffGaussian:
        return "diff-gaussian";
    case RasterRules::Gsplat:
        return "gsplat";
    }
    return "unknown";
}

ModelParams paramsOf(const Checkpoint& checkpoint)
{
    ModelParams params{};
    params.family = uint32_t(checkpoint.family);
    params.flags = checkpoint.flags;
    params.feat_dim = checkpoint.feat_dim;
    params.n_offsets = checkpoint.n_offsets;
    params.appearance_dim = checkpoint.appearance_dim;
    params.appearance_rows =
        checkpoint.appearance_dim ? uint32_t(checkpoint.embedding.size() / checkpoint.appearance_dim) : 0;
    params.level_rule = uint32_t(checkpoint.level_rule);
    params.fork = checkpoint.fork;
    params.level_min = checkpoint.level_min;
    params.level_clamp = checkpoint.level_clamp;
    params.standard_dist = checkpoint.standard_dist;
    params.voxel_size = checkpoint.voxel_size;
    params.raster_rules = uint32_t(checkpoint.raster_rules);
    params.mlp_count = uint32_t(checkpoint.mlps.size());
    return params;
}

Json modelJson(const ModelParams& params, uint64_t anchors)
{
    const bool has_levels = params.flags & kModelHasLevels;
    Json json = {
        {"family", familyName(params.family)},
        {"anchors", anchors},
        {"feat_dim", params.feat_dim},
        {"n_offsets", params.n_offsets},
        {"feature_bank", bool(params.flags & kModelFeatureBank)},
        {"appearance", {{"dim", params.appearance_dim}, {"rows", params.appearance_rows}}},
        {"voxel_size", jsonNumber(double(params.voxel_size))},
        {"background", params.flags & kModelWhiteBackground ? "white" : "black"},
        {"raster_rules", rasterRulesName(params.raster_rules)},
    };
    if (has_levels)
        json["lod"] = {
            {"rule", levelRuleName(params.level_rule)},
            {"fork", params.fork},
            {"level_min", params.level_min},
            {"level_clamp", params.level_clamp},
            {"standard_dist", jsonNumber(double(params.standard_dist))},
        };
    else
        json["lod"] = nullptr;
    return json;
}

std::string modelText(const ModelParams& params, uint64_t anchors)
{
    std::string text = formatString("model       %s, %s anchors x %u offsets, %u features", familyName(params.family),
                                    formatCount(anchors).c_str(), params.n_offsets, params.feat_dim);
    if (params.flags & kModelFeatureBank)
        text += ", feature bank";
    if (params.appearance_dim)
        text += formatString(", appearance %u rows x %u", params.appearance_rows, params.appearance_dim);
    if (params.flags & kModelHasLevels)
        text += formatString("\nlod         %s, fork %u, levels %d to %d, standard distance %g",
                             levelRuleName(params.level_rule), params.fork, params.level_min,
                             params.level_min + params.level_clamp, double(params.standard_dist));
    return text;
}

} // namespace gsc
