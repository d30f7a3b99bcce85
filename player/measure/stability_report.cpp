// SPDX-License-Identifier: Apache-2.0
#include <gsc/error.h>
#include "runtime/records/reuse_names.h"
#include "runtime/records/run_row.h"
#include "player/measure/stability.h"
#include <gsc/frame_stats.h>
#include "player/options/level_report.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>

namespace gsc {

namespace {

OrderedJson verdictsJson(const StabilityPath& entry)
{
    OrderedJson json = OrderedJson::object();
    for (const Verdict& verdict : entry.verdicts)
        json[verdict.bound] = {{"limit", verdict.limit},
                               {"value", verdict.bound == std::string("psnr") ? jsonNumber(boundedPsnr(verdict.value))
                                                                              : jsonNumber(verdict.value)},
                               {"frame", verdict.frame},
                               {"passed", verdict.passed}};
    return json;
}

OrderedJson pathJson(const StabilityPath& entry)
{
    return {{"trajectory", entry.name},        {"cameras", entry.cameras},        {"frames", entry.frames},
            {"ipd", unknownIfZero(entry.ipd)}, {"ms", toJson(entry.ms)},          {"accuracy", toJson(entry.accuracy)},
            {"reuse", toJson(entry.reuse)},    {"verdicts", verdictsJson(entry)}, {"passed", entry.passed()}};
}

constexpr const char* kBounds[] = {"psnr", "temporal", "p99"};

void describe(const Record& at, Verdict& verdict)
{
    at.field("limit", verdict.limit, kNumber);
    at.fieldOrNull("value", verdict.value, kNumber, std::numeric_limits<double>::infinity());
    at.field("frame", verdict.frame, kCount);
    at.field("passed", verdict.passed, kFlag);
}

std::string popText(const Accuracy& accuracy)
{
    return accuracy.error_pop.images > 0 ? formatString("%.4f", accuracy.error_pop.max * 255) : "-";
}

std::string valueText(const Verdict& verdict)
{
    if (verdict.bound == std::string("psnr"))
        return decibels(verdict.value, " dB");
    return formatString("%.4g times", verdict.value);
}

} // namespace

namespace {

OrderedJson reportJson(const StabilityOptions& options, const StabilitySummary& summary,
                       std::span<const StabilityPath> shown)
{
    const PlayOptions& play = options.play;
    OrderedJson paths = OrderedJson::array();
    for (const StabilityPath& entry : shown)
        paths.push_back(pathJson(entry));
    // a shard may have none
    const DeviceFacts device = shown.empty() ? DeviceFacts{} : shown.back().device;
    return {
        {"schema", "gsc.stability/1"},
        {"tool", toJson(thisTool())},
        {"file", toJson(summary.file)},
        {"backend", summary.backend},
        {"reference", summary.reference},
        {"device", toJson(device)},
        {"tier", tierName(shown.empty() ? play.frame.tier : shown.back().tier)},
        {"eyes", play.view.eyes},
        {"stereo", stereoName(play.frame.stereo)},
        {"size", play.view.width > 0 ? OrderedJson{play.view.width, play.view.height} : OrderedJson()},
        {"fov_degrees", unknownIfZero(play.view.fov_x * 180 / std::numbers::pi)},
        {"warmup", options.warmup},
        {"reuse", toJson(reuseFacts(play.frame.reuse))},
        {"lod_bias", play.frame.lod_bias},
        {"lod_fade", play.frame.lod_fade},
        {"lod_hysteresis", play.frame.lod_hysteresis},
        {"detail", play.frame.detailPixels()},
        {"fovea_pixels", foveaJson(play.frame)},
        {"bounds",
         {{"psnr", unknownIfZero(options.bound_psnr)},
          {"temporal", unknownIfZero(options.bound_temporal)},
          {"p99", unknownIfZero(options.bound_p99)}}},
        {"trajectories", std::move(paths)},
        {"passed", std::ranges::all_of(shown, &StabilityPath::passed)},
        {"warnings", summary.warnings},
    };
}

} // namespace

std::string stabilityReportJson(const StabilityOptions& options, const StabilitySummary& summary, bool tells_shard)
{
    OrderedJson json = reportJson(options, summary, summary.paths);
    if (const Shard& shard = options.play.shard; shard.isGiven() && tells_shard)
        json["shard"] = {{"index", shard.index},
                         {"count", shard.count},
                         {"tasks", summary.all_paths},
                         {"own", summary.paths.size()},
                         {"done_before", summary.paths_before}};
    return jsonText(json, 2) + "\n";
}

std::string stabilityRow(const StabilityOptions& options, const StabilitySummary& summary, const StabilityPath& path)
{
    return jsonText(reportJson(options, summary, std::span(&path, 1)), -1);
}

StabilityPath readStabilityRow(const OrderedJson& row, const std::string& where)
{
    StabilityPath path;
    constexpr const char* form = "gsc.stability/1";
    const Record report(row, where, form);
    describe(report.object("device"), path.device);
    std::string tier;
    report.field("tier", tier, kName);
    path.tier = tier == tierName(Tier::Exact) ? Tier::Exact : Tier::Fast;
    OrderedJson list;
    report.field("trajectories", list, kOneTrajectory);
    const Record at(list[0], where + ": trajectories[0]", form);
    at.field("trajectory", path.name, kName);
    at.field("cameras", path.cameras, kText);
    at.field("frames", path.frames, kCount);
    at.fieldOrNull("ipd", path.ipd, kPositive);
    describe(at.object("ms"), path.ms);
    describe(at.object("accuracy"), path.accuracy);
    describe(at.object("reuse"), path.reuse);
    for (const char* bound : kBounds)
        if (const Record verdicts = at.object("verdicts"); verdicts.has(bound)) {
            Verdict verdict{bound, 0, 0};
            describe(verdicts.object(bound), verdict);
            path.verdicts.push_back(verdict);
        }
    return path;
}

std::string stabilityReportText(const StabilityOptions& options, const StabilitySummary& summary)
{
    std::string text =
        formatString("%s: %s, %s against exact of %s\n", options.play.model.file.c_str(), summary.backend.c_str(),
                     tierName(summary.paths.empty() ? options.play.frame.tier : summary.paths.back().tier),
                     summary.reference.c_str());
    if (options.play.shard.isGiven())
        text += formatString("shard %s: %zu of %s, %s of them done before\n", options.play.shard.text().c_str(),
                             summary.paths.size(), formatCount(summary.all_paths, "trajectory", "trajectories").c_str(),
                             formatCount(summary.paths_before).c_str());
    text += formatString("%-20s %7s %9s %9s %9s %9s %9s %9s %9s %9s  %s\n", "trajectory", "frames", "ms", "p99 ms",
                         "PSNR dB", "worst dB", "flicker", "most", "pop", "hits %", "verdict");
    for (const StabilityPath& entry : summary.paths) {
        const Accuracy& accuracy = entry.accuracy;
        const Spread& wall = entry.ms.wall;
        text += formatString("%-20s %7llu %9.2f %9.2f %9s %9s %9.4f %9.4f %9s %9.1f  %s\n", entry.name.c_str(),
                             static_cast<unsigned long long>(entry.frames), wall.median, wall.p99,
                             decibels(accuracy.psnr_pooled).c_str(), decibels(accuracy.psnr_min).c_str(),
                             accuracy.temporal.p50 * 255, accuracy.temporal.max * 255, popText(accuracy).c_str(),
                             100 * entry.reuse.hit_rate, entry.passed() ? "ok" : "EXCEEDED");
        if (accuracy.fovea)
            text += "    " + foveaText(*accuracy.fovea);
        for (const Verdict& verdict : entry.verdicts)
            if (!verdict.passed)
                text += formatString("    %s: %s in frame %llu, bound %g\n", verdict.bound, valueText(verdict).c_str(),
                                     static_cast<unsigned long long>(verdict.frame), verdict.limit);
    }
    return text + "flicker, most: rms of the change of the error image, median and largest; pop: largest "
                  "change of a 16 x 16 square of it beyond those before and after; all in 1/255\n";
}

} // namespace gsc
