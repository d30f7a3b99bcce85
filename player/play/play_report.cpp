// SPDX-License-Identifier: Apache-2.0
#include "player/play/play_report.h"

#include "player/devices/worker_report.h"
#include "runtime/records/frame_numbers.h"
#include "runtime/records/reuse_names.h"
#include "runtime/cli/version.h"
#include "player/options/level_report.h"

#include <cmath>

namespace gsc {

namespace {

using Json = OrderedJson;

double meanCount(const PlayOptions& options, const PlaySummary& summary, uint64_t EyeCounts::*field)
{
    return countPerEye(summary.frames, options.view.eyes, field).mean;
}

// Describes in one line how reuse did; empty without reuse.
std::string reuseText(const PlayOptions& options, const PlaySummary& summary)
{
    if (options.frame.reuse.policy == ReusePolicy::None)
        return {};
    const double decoded = meanCount(options, summary, &EyeCounts::anchors_decoded);
    const double reused = meanCount(options, summary, &EyeCounts::anchors_reused);
    std::string text =
        formatString("reuse %s: %.1f %% of anchors drawn again, cache %s, %s", policyName(options.frame.reuse.policy),
                     reused > 0 ? 100 * reused / (reused + decoded) : 0.0,
                     formatBytes(mostOf(summary.frames, &FrameResult::cache_bytes)).c_str(),
                     formatCount(sumOf(summary.frames, &FrameResult::cache_evictions), "eviction").c_str());
    const double overdue = meanCount(options, summary, &EyeCounts::anchors_overdue);
    if (overdue > 0)
        text += formatString("; %.1f anchors per eye overdue for want of budget", overdue);
    return text + "\n";
}

// Describes in one line the shard and how much of the run it did; empty if the run is not split.
std::string shardText(const PlayOptions& options, const PlaySummary& summary)
{
    if (!options.shard.isGiven())
        return {};
    return formatString("shard %s: %s of %s, %s of them done before\n", options.shard.text().c_str(),
                        formatCount(summary.shard_frames).c_str(), formatCount(summary.set_frames, "frame").c_str(),
                        formatCount(summary.frames_before).c_str());
}

} // namespace

std::string playReportText(const PlayOptions& options, const PlaySummary& summary)
{
    if (summary.frames.empty()) // a shard may have had nothing left to do
        return shardText(options, summary);
    const FrameTimes times = timesOf(summary.frames);
    const double median = times.device.median;
    std::string text = formatString("%s, %s, %s, %s: median %.1f ms (%.1f frames/s), p95 %.1f ms, worst %.1f ms\n",
                                    formatCount(summary.frames.size(), "frame").c_str(),
                                    options.view.eyes == 1                       ? "one eye"
                                    : options.frame.stereo == StereoMode::Merged ? "two eyes decoded at once"
                                                                                 : "two eyes",
                                    tierName(summary.tier), summary.backend.c_str(), median,
                                    median > 0 ? 1000 / median : 0.0, times.device.p95, times.device.max);
    const auto meanText = [&](uint64_t EyeCounts::*field, const char* noun) {
        return formatCount(uint64_t(std::llround(meanCount(options, summary, field))), noun);
    };
    text += "mean ms:";
    for (size_t i = 0; i < std::size(kStages); ++i)
        text += formatString(" %s %.1f", kStages[i].name, times.stages[i].mean);
    text += formatString(
        "\nmean per eye: %s visible, %s on screen, %s\n", meanText(&EyeCounts::anchors_visible, "anchor").c_str(),
        meanText(&EyeCounts::gaussians_visible, "Gaussian").c_str(), meanText(&EyeCounts::pairs, "tile pair").c_str());
    if (const double dropped = meanCount(options, summary, &EyeCounts::gaussians_dropped); dropped > 0)
        text += formatString("dropped: %.1f Gaussians per eye that are not finite\n", dropped);
    text += reuseText(options, summary) + detailText(summary.frame, summary.frames) +
            targetText(summary.frame.target_ms, targetFacts(summary.frame, summary.frames)) +
            workersText(serviceFacts(summary.service));
    text += shardText(options, summary);
    if (!summary.images.empty())
        text += formatString("%s: %s%s\n", formatCount(summary.images.size(), "image").c_str(),
                             summary.images.front().c_str(),
                             summary.images.size() > 1 ? (" .. " + summary.images.back()).c_str() : "");
    if (!options.output.video.empty())
        text += "video: " + options.output.video + "\n";
    return text;
}

std::string playReportJson(const PlayOptions& options, const PlaySummary& summary,
                           const std::vector<std::string>& warnings)
{
    const FrameTimes times = timesOf(summary.frames);
    Json stages, counts;
    for (size_t i = 0; i < std::size(kStages); ++i)
        stages[kStages[i].name] = times.stages[i].mean;
    for (const EyeCount& count : std::span(kEyeCounts).subspan(kTestedCounts))
        counts[count.name] = meanCount(options, summary, count.field);
    double pixels = 0;
    for (const TimedFrame& frame : summary.frames)
        pixels += frame.pixels * options.view.eyes;
    Json json = {
        {"schema", "gsc.play/1"},
        {"tool", {{"name", "gsc-play"}, {"version", toolVersion()}}},
        {"file", toJson(summary.file)},
        {"backend", summary.backend},
        {"tier", tierName(summary.tier)},
        {"eyes", options.view.eyes},
        {"stereo", stereoName(options.frame.stereo)},
        {"frames", summary.frames.size()},
        {"pixels", pixels},
        {"ms",
         {{"open", summary.open_ms},
          {"load", summary.load_ms},
          {"frame_mean", times.device.mean},
          {"frame_p50", times.device.median},
          {"frame_p95", times.device.p95},
          {"frame_p99", times.device.p99},
          {"frame_max", times.device.max},
          {"stages_mean", std::move(stages)}}},
        {"reuse", toJson(reuseFacts(options.frame.reuse))},
        {"mean_per_eye", std::move(counts)},
        {"bytes_resident", mostOf(summary.frames, &FrameResult::bytes_resident)},
        {"cache_bytes", mostOf(summary.frames, &FrameResult::cache_bytes)},
        {"cache_evictions", sumOf(summary.frames, &FrameResult::cache_evictions)},
        {"workers", workersJson(summary.service)},
        {"images", summary.images},
        {"warnings", warnings},
    };
    json.update(lodJson(summary.frame, summary.frames));
    if (!options.output.video.empty())
        json["video"] = options.output.video;
    if (options.shard.isGiven())
        json["shard"] = {{"index", options.shard.index},
                         {"count", options.shard.count},
                         {"tasks", summary.set_frames},
                         {"own", summary.shard_frames},
                         {"done_before", summary.frames_before}};
    return jsonText(json, 2) + "\n";
}

} // namespace gsc
