// SPDX-License-Identifier: Apache-2.0
#include "convert/commands/model_facts.h"

#include "convert/input/model_names.h"
#include "runtime/records/report_parts.h"

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

std::string bakedText(const Json& reduction)
{
    if (!reduction.is_object())
        return "";
    const auto count = [&](const char* key, const char* one) {
        const bool known = reduction.contains(key) && reduction[key].is_number_unsigned();
        return known ? formatCount(reduction[key].get<uint64_t>(), one)
                     : "an unknown number of " + std::string(one) + "s";
    };
    const auto psnrOf = [](const Json& of, const char* key) {
        const bool known = of.is_object() && of.contains(key) && of[key].is_number();
        return known ? decibels(of[key].get<double>(), " dB") : std::string();
    };
    const std::string target = psnrOf(reduction, "target_psnr");
    std::string text = "from the whole model, " + (target.empty() ? "without a target" : "to " + target) + ": " +
                       count("anchors_left_out", "anchor") + " left out, " + count("slots_masked", "slot") + " masked";
    const Json verdict = reduction.contains("verdict") ? reduction["verdict"] : Json();
    const std::string psnr = psnrOf(verdict, "psnr"), worst = psnrOf(verdict, "worst_psnr");
    if (!psnr.empty())
        text += "; pictures keep " + psnr + (worst.empty() ? "" : ", the worst " + worst);
    else if (verdict.is_object() && verdict.contains("psnr")) // null
        text += "; pictures are equal";
    return text;
}

} // namespace gsc
