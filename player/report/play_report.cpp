// SPDX-License-Identifier: Apache-2.0
#include "player/report/play_report.h"

#include "player/report/report_parts.h"
#include "player/report/reuse_names.h"
#include "player/report/stage_names.h"
#include "player/tool/version.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>

namespace gsc {

namespace {

using Json = OrderedJson;

constexpr struct {
    const char* name;
    uint64_t EyeCounts::*field;
} kCounts[] = {
    {"anchors_visible", &EyeCounts::anchors_visible},     {"anchors_decoded", &EyeCounts::anchors_decoded},
    {"anchors_reused", &EyeCounts::anchors_reused},       {"anchors_overdue", &EyeCounts::anchors_overdue},
    {"gaussians_alive", &EyeCounts::gaussians_alive},     {"gaussians_visible", &EyeCounts::gaussians_visible},
    {"gaussians_dropped", &EyeCounts::gaussians_dropped}, {"pairs", &EyeCounts::pairs},
    {"blend_evaluations", &EyeCounts::blend_evaluations},
};

// Nearest-rank quantile of frame times, milliseconds. Precondition: at least one frame.
double quantile(const PlaySummary& summary, double q)
{
    std::vector<double> times;
    for (const FrameResult& frame : summary.frames)
        times.push_back(frame.times.total);
    std::sort(times.begin(), times.end());
    return nearestRank(times, q);
}

double meanStage(const PlaySummary& summary, double StageTimes::*field)
{
    double sum = 0;
    for (const FrameResult& frame : summary.frames)
        sum += frame.times.*field;
    return sum / double(summary.frames.size());
}

// Per eye and frame.
double meanCount(const PlaySummary& summary, uint64_t EyeCounts::*field)
{
    double sum = 0;
    for (const FrameResult& frame : summary.frames)
        for (int eye = 0; eye < summary.eyes; ++eye)
            sum += double(frame.eyes[eye].*field);
    return sum / double(summary.frames.size()) / summary.eyes;
}

// Of all frames.
uint64_t most(const PlaySummary& summary, uint64_t FrameResult::*field)
{
    uint64_t peak = 0;
    for (const FrameResult& frame : summary.frames)
        peak = std::max(peak, frame.*field);
    return peak;
}

uint64_t evictions(const PlaySummary& summary)
{
    uint64_t sum = 0;
    for (const FrameResult& frame : summary.frames)
        sum += frame.cache_evictions;
    return sum;
}

// One line; empty without reuse.
std::string reuseText(const PlaySummary& summary)
{
    if (summary.reuse.policy == ReusePolicy::None)
        return {};
    const double decoded = meanCount(summary, &EyeCounts::anchors_decoded);
    const double reused = meanCount(summary, &EyeCounts::anchors_reused);
    std::string text =
        formatString("reuse %s: %.1f %% of anchors drawn again, cache %.1f MiB, %llu evictions",
                     policyName(summary.reuse.policy), reused > 0 ? 100 * reused / (reused + decoded) : 0.0,
                     double(most(summary, &FrameResult::cache_bytes)) / double(1 << 20),
                     static_cast<unsigned long long>(evictions(summary)));
    const double overdue = meanCount(summary, &EyeCounts::anchors_overdue);
    if (overdue > 0)
        text += formatString("; for want of budget %.1f overdue per eye", overdue);
    return text + "\n";
}

} // namespace

std::string playReportText(const PlaySummary& summary)
{
    const double median = quantile(summary, 0.5);
    std::string text =
        formatString("%zu frame%s, %s, %s, %s: median %.1f ms (%.1f frames/s), p95 %.1f ms, worst %.1f ms\n",
                     summary.frames.size(), summary.frames.size() == 1 ? "" : "s",
                     summary.eyes == 1                      ? "one eye"
                     : summary.stereo == StereoMode::Merged ? "two eyes decoded at once"
                                                            : "two eyes",
                     tierName(summary.tier), summary.backend.c_str(), median, median > 0 ? 1000 / median : 0.0,
                     quantile(summary, 0.95), quantile(summary, 1));
    text += "mean ms:";
    for (const auto& stage : kStages)
        text += formatString(" %s %.1f", stage.name, meanStage(summary, stage.field));
    text += formatString("\nmean per eye: %.0f anchors visible, %.0f Gaussians on screen, %.0f tile pairs\n",
                         meanCount(summary, &EyeCounts::anchors_visible),
                         meanCount(summary, &EyeCounts::gaussians_visible), meanCount(summary, &EyeCounts::pairs));
    if (const double dropped = meanCount(summary, &EyeCounts::gaussians_dropped); dropped > 0)
        text += formatString("dropped: %.1f Gaussians per eye that are not finite\n", dropped);
    text += reuseText(summary) + targetText(summary.lod);
    if (!summary.images.empty())
        text += formatString("%zu image%s: %s%s\n", summary.images.size(), summary.images.size() == 1 ? "" : "s",
                             summary.images.front().c_str(),
                             summary.images.size() > 1 ? (" .. " + summary.images.back()).c_str() : "");
    return text;
}

std::string playReportJson(const PlaySummary& summary, const std::vector<std::string>& warnings)
{
    Json stages, counts;
    for (const auto& stage : kStages)
        stages[stage.name] = meanStage(summary, stage.field);
    for (const auto& count : kCounts)
        counts[count.name] = meanCount(summary, count.field);
    double pixels = 0;
    for (const double frame : summary.pixels)
        pixels += frame * summary.eyes;
    Json json = {
        {"schema", "gsc.play/1"},
        {"tool", {{"name", "gsc-play"}, {"version", toolVersion()}}},
        {"file", fileJson(summary.input, summary.file_bytes, summary.anchors)},
        {"backend", summary.backend},
        {"tier", tierName(summary.tier)},
        {"eyes", summary.eyes},
        {"stereo", stereoName(summary.stereo)},
        {"frames", summary.frames.size()},
        {"pixels", pixels},
        {"ms",
         {{"open", summary.open_ms},
          {"load", summary.load_ms},
          {"frame_mean", meanStage(summary, &StageTimes::total)},
          {"frame_p50", quantile(summary, 0.5)},
          {"frame_p95", quantile(summary, 0.95)},
          {"frame_p99", quantile(summary, 0.99)},
          {"frame_max", quantile(summary, 1)},
          {"stages_mean", std::move(stages)}}},
        {"reuse", reuseJson(summary.reuse)},
        {"mean_per_eye", std::move(counts)},
        {"bytes_resident", most(summary, &FrameResult::bytes_resident)},
        {"cache_bytes", most(summary, &FrameResult::cache_bytes)},
        {"cache_evictions", evictions(summary)},
        {"images", summary.images},
        {"warnings", warnings},
    };
    json.update(lodJson(summary.lod));
    return jsonText(json, 2) + "\n";
}

} // namespace gsc
