// SPDX-License-Identifier: Apache-2.0
#include "player/measure/run_text.h"

#include "player/devices/worker_report.h"
#include "format/numbers/count_text.h"
#include "player/options/level_report.h"
#include "player/measure/work_facts.h"
#include "runtime/cli/reporter.h"
#include "runtime/records/reuse_names.h"

#include <gsc/error.h>
#include <gsc/frame_stats.h>

#include <cmath>

namespace gsc {

namespace {

// A run in a few words, such as "error 0.5 budget 2000".
std::string shortName(const RowConfig& config)
{
    const ReuseFacts& reuse = config.reuse;
    std::string text = reuse.policy;
    if (reuse.max_depth >= 0)
        text += formatString(" %lld %.3s", static_cast<long long>(reuse.max_depth), reuse.guidance.c_str());
    if (reuse.bound >= 0)
        text += formatString(" %g", reuse.bound);
    if (reuse.decode_budget > 0)
        text += formatString(" budget %llu", static_cast<unsigned long long>(reuse.decode_budget));
    if (reuse.cache_budget > 0)
        text += formatString(" cache %.0fM", double(reuse.cache_budget) / double(1 << 20));
    if (config.stereo != stereoName(StereoMode::Exact))
        text += " " + config.stereo;
    if (config.lod_bias != 0)
        text += formatString(" lod%+g", config.lod_bias);
    if (config.lod_fade != 0)
        text += formatString(" fade %g", config.lod_fade);
    if (config.lod_hysteresis != 0)
        text += formatString(" lag %g", config.lod_hysteresis);
    if (config.detail != 0)
        text += formatString(" detail %g", config.detail);
    if (config.fovea_pixels != 0)
        text += formatString(" fovea %g", config.fovea_pixels);
    return text;
}

std::string spreadRow(const char* name, const Spread& s, std::string (*shown)(double))
{
    return formatString("  %-18s %12s %12s %12s %12s %12s\n", name, shown(s.mean).c_str(), shown(s.median).c_str(),
                        shown(s.p95).c_str(), shown(s.p99).c_str(), shown(s.max).c_str());
}

std::string tableRow(const char* name, const Spread& spread)
{
    return spreadRow(name, spread, formatMeasured);
}

std::string countRow(const char* name, const Spread& spread)
{
    return spreadRow(name, spread, [](double count) { return formatCount(uint64_t(std::llround(count))); });
}

std::string rooflineText(const RooflineFacts& roofline)
{
    const DeviceCeilings& ceilings = roofline.ceilings;
    std::string text =
        formatString("ceilings of the device: copy %.2f TB/s, read %.2f TB/s, fp32 %.1f T lane "
                     "operations/s, exp %.2f T/s, fp16 matrix %.0f TFLOP/s\n",
                     ceilings.copy_bytes_per_s * 1e-12, ceilings.read_bytes_per_s * 1e-12,
                     ceilings.fma_lane_ops_per_s * 1e-12, ceilings.exp_per_s * 1e-12, ceilings.mma_flop_per_s * 1e-12);
    text += formatString("  %-16s %10s %12s %12s %10s %11s %10s  %s\n", "", "MB", "fp32 Gop", "matrix Gop", "floor ms",
                         "measured ms", "floor in %", "bound by");
    for (const StageRoofline& stage : roofline.stages) {
        if (stage.floor_ms == 0 && stage.measured_ms == 0)
            continue; // counted within another stage
        text += formatString("  %-16s %10s %12s %12s %10s %11s %10.1f  %s\n", stage.name.c_str(),
                             formatMeasured((stage.bytes_read + stage.bytes_written) * 1e-6).c_str(),
                             formatMeasured(stage.lane_operations * 1e-9).c_str(),
                             formatMeasured(stage.matrix_flop * 1e-9).c_str(), formatMeasured(stage.floor_ms).c_str(),
                             formatMeasured(stage.measured_ms).c_str(), stage.percent,
                             stage.bound.empty() ? "-" : stage.bound.c_str());
    }
    return text;
}

std::string memoryText(const RunRow& row)
{
    std::string text = "peak memory " + formatBytes(row.peak_bytes);
    if (row.device.context_bytes > 0)
        text += formatString(", of which %s the driver's context", formatBytes(row.device.context_bytes).c_str());
    const WorkFacts& work = *row.work;
    if (work.passes.max > 1)
        text += formatString("; %.1f depth passes per frame, %.0f at most", work.passes.mean, work.passes.max);
    if (work.frames_that_grew > 0)
        text += formatString("; %s enlarged a buffer, more --warmup avoids that",
                             formatCount(work.frames_that_grew, "measured frame").c_str());
    if (row.repeats > 0)
        text += formatString("\ndrawn again because a buffer was too small: %s, %s; they took %s of the device's "
                             "milliseconds above, %s at most in a frame",
                             formatCount(work.frames_repeated, "measured frame").c_str(),
                             formatCount(row.repeats, "repeat").c_str(), formatMeasured(work.repeat_ms).c_str(),
                             formatMeasured(work.most_repeat_ms).c_str());
    return text + "\n";
}

// Accuracy as a line; empty if nothing was scored.
std::string accuracyText(const RunRow& row)
{
    if (!row.accuracy)
        return {};
    const Accuracy& accuracy = *row.accuracy;
    std::string text =
        formatString("against exact of %s, %s: ", row.reference.c_str(), formatCount(accuracy.images, "image").c_str());
    text += accuracy.max_error == 0 ? "identical"
                                    : formatString("PSNR %s pooled, %s worst, largest error %.4g",
                                                   decibels(accuracy.psnr_pooled, " dB").c_str(),
                                                   decibels(accuracy.psnr_min, " dB").c_str(), accuracy.max_error);
    return text + "\n" + (accuracy.fovea ? foveaText(*accuracy.fovea) : "");
}

std::string popText(const Accuracy& accuracy)
{
    return accuracy.error_pop.images > 0 ? formatString("%.4f", accuracy.error_pop.max * 255) : "-";
}

std::string valueText(const Verdict& verdict)
{
    return verdict.bound == "psnr" ? decibels(verdict.value, " dB") : formatString("%.4g times", verdict.value);
}

} // namespace

std::string benchText(const RunRow& row)
{
    const RowConfig& config = row.config;
    const WorkFacts& work = *row.work;
    const DeviceFacts& device = row.device;
    std::string text =
        formatString("%s: %s, %s, %s, %s; %s", row.file.path.c_str(), formatCount(row.file.anchors, "anchor").c_str(),
                     row.backend.c_str(), row.rendered_tier.c_str(), config.eyes == 2 ? "two eyes" : "one eye",
                     device.name.empty() ? "unknown device" : device.name.c_str());
    if (!device.driver.empty())
        text += formatString(", driver %s", device.driver.c_str());
    if (device.clock_mhz > 0)
        text += formatString(", %.0f MHz, memory %.0f MHz", device.clock_mhz, device.memory_clock_mhz);
    text += formatString("\n%s after %s of warm-up, round %s\n", formatCount(config.frames, "frame").c_str(),
                         formatCount(config.warmup).c_str(), formatCount(config.shots, "camera").c_str());
    text += formatString("  %-18s %12s %12s %12s %12s %12s\n", "milliseconds", "mean", "median", "p95", "p99", "max");
    text += tableRow("frame, wall", row.ms.wall) + tableRow("frame, device", row.ms.device);
    for (size_t i = 0; i < std::size(kStages); ++i)
        text += tableRow(kStages[i].name, row.ms.stages[i]);
    if (work.wall_median)
        text +=
            formatString("  median wall time of a frame: %s to %s, within %.2g %%, 95 %% sure\n",
                         formatMeasured(work.wall_median->low).c_str(), formatMeasured(work.wall_median->high).c_str(),
                         percentOf(*work.wall_median, row.ms.wall.median));
    const Spread& even = work.ns_per_gaussian;
    text += tableRow("ns per Gaussian", even);
    text += formatString("time per Gaussian: p99 is %.2f times the median\ncounts per eye\n",
                         even.median > 0 ? even.p99 / even.median : 0.0);
    for (size_t i = 0; i < std::size(kEyeCounts); ++i)
        text += countRow(kEyeCounts[i].name, work.per_eye[i]);
    if (config.reuse.policy != policyName(ReusePolicy::None))
        text += "cache of all eyes: bytes, entries dropped\n" + countRow("cache_bytes", work.cache_bytes) +
                countRow("cache_evictions", work.cache_evictions);
    if (config.detail > 0) {
        text += formatString("detail %g pixels: groups of all eyes\n", config.detail);
        for (size_t i = 0; i < std::size(kCoarseCounts); ++i)
            text += countRow(kCoarseCounts[i].name, work.coarse[i]);
    }
    text += targetText(config.target_ms, work.target);
    if (work.roofline)
        text += rooflineText(*work.roofline);
    return text + workersText(row.service) + memoryText(row) + accuracyText(row);
}

std::string runTableHeader()
{
    return formatString("%-14s %-8s %-32s %9s %9s %9s %9s %9s %9s %13s %7s %9s\n", "trajectory", "backend", "reuse",
                        "ms", "p99 ms", "decode ms", "PSNR dB", "p1 dB", "worst dB", "flicker 1/255", "hits %",
                        "cache MiB");
}

std::string runTableLine(const RunRow& row)
{
    const Accuracy accuracy = row.accuracy.value_or(Accuracy());
    const std::string line =
        formatString("%-14s %-8s %-32s %9.2f %9.2f %9.2f %9s %9s %9s %13s %7.1f %9.1f\n", row.config.trajectory.c_str(),
                     row.backend.c_str(), shortName(row.config).c_str(), row.ms.wall.median, row.ms.wall.p99,
                     row.ms.stages[kDecodeStage].median, decibels(boundedPsnr(accuracy.psnr_pooled)).c_str(),
                     decibels(boundedPsnr(accuracy.psnr_p1)).c_str(), decibels(boundedPsnr(accuracy.psnr_min)).c_str(),
                     accuracy.temporal.images == 0 ? "-" : formatString("%.4f", accuracy.temporal.p99 * 255).c_str(),
                     100 * row.reuse.hit_rate, double(row.reuse.cache_bytes) / double(1 << 20));
    return line + (accuracy.fovea ? "    " + foveaText(*accuracy.fovea) : "");
}

std::string stabilityTableHeader()
{
    return formatString("%-20s %7s %9s %9s %9s %9s %9s %9s %9s %9s  %s\n", "trajectory", "frames", "ms", "p99 ms",
                        "PSNR dB", "worst dB", "flicker", "most", "pop", "hits %", "verdict");
}

std::string stabilityTableLine(const RunRow& row)
{
    const Accuracy accuracy = row.accuracy.value_or(Accuracy());
    std::string text =
        formatString("%-20s %7llu %9.2f %9.2f %9s %9s %9.4f %9.4f %9s %9.1f  %s\n", row.config.trajectory.c_str(),
                     static_cast<unsigned long long>(row.config.frames), row.ms.wall.median, row.ms.wall.p99,
                     decibels(accuracy.psnr_pooled).c_str(), decibels(accuracy.psnr_min).c_str(),
                     accuracy.temporal.p50 * 255, accuracy.temporal.max * 255, popText(accuracy).c_str(),
                     100 * row.reuse.hit_rate, row.stability->passed() ? "ok" : "EXCEEDED");
    if (accuracy.fovea)
        text += "    " + foveaText(*accuracy.fovea);
    for (const Verdict& verdict : row.stability->verdicts)
        if (!verdict.passed)
            text +=
                formatString("    %s: %s in frame %llu, bound %g\n", verdict.bound.c_str(), valueText(verdict).c_str(),
                             static_cast<unsigned long long>(verdict.frame), verdict.limit);
    return text;
}

std::string stabilityTableNotes()
{
    return "flicker, most: rms of the change of the error image, median and largest; pop: largest change of a 16 x 16 "
           "square of it beyond those before and after; all in 1/255\n";
}

} // namespace gsc
