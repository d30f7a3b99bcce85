// SPDX-License-Identifier: Apache-2.0
#include "convert/bake/bake_manifest.h"

#include "convert/bake/model/gsc_checkpoint.h"

#include <cmath>

namespace gsc {

namespace {

using Json = OrderedJson;

Json decibels(double value)
{
    return std::isfinite(value) ? Json(std::round(value * 100) / 100) : Json(nullptr);
}

Json setJson(const SetScore& score)
{
    return {{"poses", score.poses.size()},
            {"psnr", decibels(score.psnr)},
            {"worst_psnr", decibels(score.worstPose().psnr)},
            {"worst", score.worstPose().name}};
}

} // namespace

std::string reductionText(const BakeReport& report, std::optional<double> target)
{
    Json levers = Json::array();
    for (uint32_t i = 0; i < kLevers; ++i)
        if (report.levers >> i & 1u)
            levers.push_back(kLeverNames[i]);
    const Json json = {{"target_psnr", target ? Json(*target) : Json(nullptr)},
                       {"levers", levers},
                       {"anchors_left_out", report.anchors_left_out},
                       {"slots_masked", report.slots_masked},
                       {"error", report.plan.error},
                       {"source_order", !(report.levers & kLeverOrder)},
                       {"against", "exact pictures of the whole model"},
                       {"weight_poses", report.weight_poses},
                       {"search", setJson(report.search)},
                       {"verdict", setJson(report.verdict)}};
    return json.dump();
}

std::string reducedFacts(std::string_view manifest, const std::string& reduction)
{
    const Json other = manifestOf(manifest);
    Json facts = Json::object();
    if (other.contains("source"))
        facts["source"] = other["source"];
    facts["reduction"] = Json::parse(reduction);
    if (other.contains("crop"))
        facts["crop"] = other["crop"];
    return facts.dump();
}

} // namespace gsc
