// SPDX-License-Identifier: Apache-2.0
#include "convert/commands/bake/bake_report.h"

#include "runtime/cli/printed_command.h"
#include "runtime/cli/version.h"
#include "runtime/records/report_parts.h"

#include <filesystem>

namespace gsc {

namespace {

Json storedJson(const BakeSizes& sizes)
{
    const StoredBytes& archive = sizes.archive;
    return {{"bytes", sizes.file},
            {"archive",
             {{"bytes", archive.file},
              {"positions", archive.positions},
              {"scales", archive.scales},
              {"offsets", archive.offsets},
              {"features", archive.features},
              {"other_anchors", archive.other_anchors},
              {"networks", archive.networks},
              {"rest", archive.rest}}}};
}

Json setJson(const SetScore& score)
{
    Json views = Json::array();
    for (const PoseScore& pose : score.poses)
        views.push_back({{"name", pose.name}, {"psnr", jsonNumber(pose.psnr)}});
    return {{"psnr", jsonNumber(score.psnr)},
            {"worst_psnr", jsonNumber(score.worstPose().psnr)},
            {"worst", score.worstPose().name},
            {"poses", std::move(views)}};
}

std::string setText(const char* name, const SetScore& score)
{
    return formatString("%-11s %s, PSNR %s pooled, worst %s at %s\n", name,
                        formatCount(score.poses.size(), "pose").c_str(), decibels(score.psnr, " dB").c_str(),
                        decibels(score.worstPose().psnr, " dB").c_str(), score.worstPose().name.c_str());
}

std::string bytesText(const char* name, const BakeSizes& sizes, uint64_t anchors)
{
    return formatString("%-11s %s; archive %s, %.1f bytes an anchor\n", name, formatBytes(sizes.file).c_str(),
                        formatBytes(sizes.archive.file).c_str(), double(sizes.archive.file) / double(anchors));
}

} // namespace

Json bakeJson(const BakeOptions& options, const BakeReport& report, bool packed)
{
    Json levers = Json::array(), stages = Json::array();
    const std::vector<int64_t> shares = leverShares(report);
    for (uint32_t i = 0; i < kLevers; ++i)
        levers.push_back({{"name", kLeverNames[i]}, {"used", (report.levers >> i & 1u) != 0}, {"bytes", shares[i]}});
    for (const BakeStage& stage : report.stages)
        stages.push_back({{"name", stage.name}, {"seconds", jsonNumber(stage.seconds)}});
    return {{"schema", "gsc.bake/1"},
            {"generator", {{"name", "gsc"}, {"version", toolVersion()}}},
            {"path", options.name},
            {"output", options.output},
            {"packed", packed},
            {"target_psnr", options.target_psnr ? Json(report.target) : Json(nullptr)},
            {"min_view_psnr", options.target_psnr ? Json(report.min_view) : Json(nullptr)},
            {"anchors",
             {{"source", report.anchors}, {"left_out", report.anchors_left_out}, {"unseen", report.anchors_unseen}}},
            {"slots", {{"source", report.slots}, {"masked", report.slots_masked}}},
            {"error", report.plan.error},
            {"costs",
             {{"feature", report.plan.costs.feature},
              {"place", report.plan.costs.place},
              {"size", report.plan.costs.size}}},
            {"before", storedJson(report.before)},
            {"after", storedJson(report.after)},
            {"archive_bytes_per_anchor", jsonNumber(double(report.after.archive.file) / double(report.anchors))},
            {"levers", std::move(levers)},
            {"weight_poses", report.weight_poses},
            {"search", setJson(report.search)},
            {"verdict", setJson(report.verdict)},
            {"probes", report.probes},
            {"pictures", {{"drawn", report.pictures_drawn}, {"kept", report.pictures_kept}}},
            {"device", report.device},
            {"stages", std::move(stages)},
            {"seconds", jsonNumber(report.seconds)},
            {"peak_memory_bytes", peakMemoryBytes()}};
}

std::string bakeText(const BakeOptions& options, const BakeReport& report, bool packed)
{
    std::string text = formatString("wrote       %s%s\n", options.output.c_str(), packed ? ", packed" : "");
    text += formatString("left out    %s of %s; masked %s of %s of the others\n",
                         formatCount(report.anchors_left_out).c_str(), formatCount(report.anchors, "anchor").c_str(),
                         formatCount(report.slots_masked).c_str(), formatCount(report.slots, "slot").c_str());
    if (report.anchors_unseen > 0)
        text += formatString("unseen      %s that no pose looked at, kept\n",
                             formatCount(report.anchors_unseen, "anchor").c_str());
    text += bytesText("before", report.before, report.anchors) + bytesText("after", report.after, report.anchors);
    const std::vector<int64_t> shares = leverShares(report);
    for (uint32_t i = 0; i < kLevers; ++i)
        if ((report.levers >> i & 1u) &&
            // kLeverCompact may show 0 bytes because they count for another lever
            (shares[i] != 0 || 1u << i != kLeverCompact))
            text += formatString("  %-9s %.1f bytes an anchor less\n", kLeverNames[i],
                                 double(shares[i]) / double(report.anchors));
    text += formatString("weights     %s; drawn by %s\n", formatCount(report.weight_poses, "pose").c_str(),
                         report.device.c_str());
    text += setText("search", report.search) + setText("verdict", report.verdict);
    if (!packed)
        text += formatString("pack it     gsc archive %s -o %s makes %s of it; so does --archive here\n",
                             shellWord(options.output).c_str(),
                             shellWord(std::filesystem::path(options.output).replace_extension(".archive.gsc")).c_str(),
                             formatBytes(report.after.archive.file).c_str());
    return text;
}

} // namespace gsc
