// SPDX-License-Identifier: Apache-2.0
#include "convert/commands/model_facts.h"

#include "convert/input/model_names.h"

namespace gsc {

Json modelJson(const ModelParams& params, uint64_t anchors)
{
    const bool has_levels = params.flags & kModelHasLevels;
    Json json = {
        {"family", kFamilyNames[params.family]},
        {"anchors", anchors},
        {"feat_dim", params.feat_dim},
        {"n_offsets", params.n_offsets},
        {"feature_bank", bool(params.flags & kModelFeatureBank)},
        {"appearance", {{"dim", params.appearance_dim}, {"rows", params.appearance_rows}}},
        {"voxel_size", jsonNumber(double(params.voxel_size))},
        {"background", params.flags & kModelWhiteBackground ? "white" : "black"},
        {"raster_rules", kRasterRulesNames[params.raster_rules]},
    };
    if (has_levels)
        json["lod"] = {
            {"rule", kLevelRuleNames[params.level_rule]},
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
    std::string text =
        formatString("model       %s, %s x %s, %s", kFamilyNames[params.family], formatCount(anchors, "anchor").c_str(),
                     formatCount(params.n_offsets, "offset").c_str(), formatCount(params.feat_dim, "feature").c_str());
    if (params.flags & kModelFeatureBank)
        text += ", feature bank";
    if (params.appearance_dim)
        text += formatString(", appearance %s x %u", formatCount(params.appearance_rows, "row").c_str(),
                             params.appearance_dim);
    if (params.flags & kModelHasLevels)
        text += formatString("\nlod         %s, fork %u, levels %d to %d, standard distance %g",
                             kLevelRuleNames[params.level_rule], params.fork, params.level_min,
                             params.level_min + params.level_clamp, double(params.standard_dist));
    return text;
}

} // namespace gsc
