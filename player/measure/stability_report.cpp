// SPDX-License-Identifier: Apache-2.0
#include "format/error.h"
#include "player/report/reuse_names.h"
#include "player/report/run_row.h"
#include "player/measure/stability.h"
#include "runtime/frame_stats.h"

#include <cmath>
#include <numbers>

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

OrderedJson pathJson(const StabilityOptions& options, const StabilityPath& entry)
{
    return {{"trajectory", entry.path.name},
            {"cameras", entry.path.cameras},
            {"frames", entry.path.shots.size()},
            {"ipd", entry.path.eye_count == 2 ? unknownIfZero(entry.path.shots.front().ipd) : OrderedJson()},
            {"ms", toJson(timesOf(timedFrames(entry.run.frames, options.warmup)))},
            {"accuracy", toJson(entry.run.accuracy)},
            {"reuse", toJson(reuseCounts(entry.run.frames))},
            {"verdicts", verdictsJson(entry)},
            {"passed", entry.passed()}};
}

std::string valueText(const Verdict& verdict)
{
    if (verdict.bound == std::string("psnr"))
        return decibels(verdict.value, " dB");
    return formatString("%.4g times", verdict.value);
}

} // namespace

std::string stabilityReportJson(const StabilityOptions& options, const StabilitySummary& summary)
{
    const PlayOptions& play = options.play;
    const RunResult& last = summary.paths.back().run;
    OrderedJson paths = OrderedJson::array();
    for (const StabilityPath& entry : summary.paths)
        paths.push_back(pathJson(options, entry));
    const OrderedJson json = {
        {"schema", "gsc.stability/1"},
        {"tool", toJson(thisTool())},
        {"file", toJson(summary.file)},
        {"backend", summary.backend},
        {"reference", summary.reference},
        {"device", toJson(last.device)},
        {"tier", tierName(last.tier)},
        {"eyes", play.eyes},
        {"stereo", stereoName(play.stereo)},
        {"size", play.width > 0 ? OrderedJson{play.width, play.height} : OrderedJson()},
        {"fov_degrees", unknownIfZero(play.fov_x * 180 / std::numbers::pi)},
        {"warmup", options.warmup},
        {"reuse", toJson(reuseFacts(play.reuse))},
        {"lod_bias", play.lod_bias},
        {"lod_fade", play.lod_fade},
        {"lod_hysteresis", play.lod_hysteresis},
        {"bounds",
         {{"psnr", unknownIfZero(options.bound_psnr)},
          {"temporal", unknownIfZero(options.bound_temporal)},
          {"p99", unknownIfZero(options.bound_p99)}}},
        {"trajectories", std::move(paths)},
        {"passed", summary.passed()},
        {"warnings", summary.warnings},
    };
    return jsonText(json, 2) + "\n";
}

std::string stabilityReportText(const StabilityOptions& options, const StabilitySummary& summary)
{
    std::string text =
        formatString("%s: %s, %s against exact of %s\n", options.play.input.c_str(), summary.backend.c_str(),
                     tierName(summary.paths.back().run.tier), summary.reference.c_str());
    text += formatString("%-20s %7s %9s %9s %9s %9s %9s %9s %9s  %s\n", "trajectory", "frames", "ms", "p99", "PSNR",
                         "worst", "flicker", "most", "hits %", "verdict");
    for (const StabilityPath& entry : summary.paths) {
        const Accuracy& accuracy = entry.run.accuracy;
        const Spread wall = timesOf(timedFrames(entry.run.frames, options.warmup)).wall;
        text +=
            formatString("%-20s %7zu %9.2f %9.2f %9s %9s %9.4f %9.4f %9.1f  %s\n", entry.path.name.c_str(),
                         entry.path.shots.size(), wall.median, wall.p99, decibels(accuracy.psnr_pooled).c_str(),
                         decibels(accuracy.psnr_min).c_str(), accuracy.temporal.p50 * 255, accuracy.temporal.max * 255,
                         100 * reuseCounts(entry.run.frames).hit_rate, entry.passed() ? "ok" : "EXCEEDED");
        for (const Verdict& verdict : entry.verdicts)
            if (!verdict.passed)
                text += formatString("    %s: %s in frame %llu, bound %g\n", verdict.bound, valueText(verdict).c_str(),
                                     static_cast<unsigned long long>(verdict.frame), verdict.limit);
    }
    return text + "flicker, most: rms of the change of the error image, median and largest, in 1/255\n";
}

} // namespace gsc
