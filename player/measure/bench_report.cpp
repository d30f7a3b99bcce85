// SPDX-License-Identifier: Apache-2.0
// The report of gsc-play bench, as JSON and as a table.
#include "player/measure/bench.h"

#include <gsc/error.h>
#include "player/devices/worker_report.h"
#include "runtime/records/reuse_names.h"
#include "runtime/records/run_row.h"
#include <gsc/frame_stats.h>
#include "player/options/level_report.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

namespace gsc {

namespace {

using Json = OrderedJson;

constexpr struct {
    const char* name;
    uint64_t FrameResult::*field;
} kCacheCounts[] = {
    {"cache_bytes", &FrameResult::cache_bytes},
    {"cache_evictions", &FrameResult::cache_evictions},
};

// Nanoseconds of device time per Gaussian on screen: how even the frames are once the path's own load is taken out.
Spread perGaussian(const BenchSummary& summary)
{
    return spreadOf(summary.frames, [](const TimedFrame& frame) {
        const uint64_t visible = ofEyes(frame, &EyeCounts::gaussians_visible);
        return frame.result.times.total * 1e6 / double(std::max<uint64_t>(visible, 1));
    });
}

Spread cacheCount(const BenchSummary& summary, uint64_t FrameResult::*field)
{
    return spreadOf(summary.frames, [&](const TimedFrame& frame) { return double(frame.result.*field); });
}

Spread passesOf(const BenchSummary& summary)
{
    return spreadOf(summary.frames, [](const TimedFrame& frame) { return double(frame.result.passes); });
}

Json meanAndMax(const Spread& spread)
{
    return {{"mean", spread.mean}, {"max", spread.max}};
}

// Frames that had to enlarge a buffer; none after enough warm-up.
uint32_t grownFrames(const BenchSummary& summary)
{
    uint32_t grown = 0;
    uint64_t most = summary.warm_bytes;
    for (const TimedFrame& frame : summary.frames) {
        grown += most > 0 && frame.result.bytes_resident > most;
        most = std::max(most, frame.result.bytes_resident);
    }
    return grown;
}

// Cost of drawing frames again. Where frames take several passes some are drawn again whatever the warm-up.
struct Repeats {
    uint32_t frames = 0;
    uint64_t count = 0;
    double sum_ms = 0, max_ms = 0; // device time; max: of one frame
};

Repeats repeatsOf(const BenchSummary& summary)
{
    Repeats repeats;
    for (const TimedFrame& frame : summary.frames) {
        repeats.frames += frame.result.repeats > 0;
        repeats.count += frame.result.repeats;
        repeats.sum_ms += frame.result.repeat_ms;
        repeats.max_ms = std::max(repeats.max_ms, frame.result.repeat_ms);
    }
    return repeats;
}

// A stage against the floor of its work.
struct RooflineRow {
    const char* name;
    StageWork work; // medians over the frames, each by itself
    StageFloor floor;
    double measured_ms = 0; // median

    // Share of the binding ceiling that the stage reached; 0 = not timed or no work.
    [[nodiscard]] double percent() const { return measured_ms > 0 ? 100 * floor.ms / measured_ms : 0; }
};

constexpr struct {
    const char* name;
    StageWork FrameWork::*work;
    double StageTimes::*time;
} kRooflineStages[] = {
    {"select", &FrameWork::select, &StageTimes::select}, {"decode", &FrameWork::decode, &StageTimes::decode},
    {"bin", &FrameWork::bin, &StageTimes::bin},          {"sort", &FrameWork::sort, &StageTimes::sort},
    {"blend", &FrameWork::blend, &StageTimes::blend},
};

constexpr double StageWork::*kWorkFields[] = {&StageWork::bytes_read, &StageWork::bytes_written,
                                              &StageWork::lane_operations, &StageWork::exponentials,
                                              &StageWork::matrix_flop};

// Stages, then the frame. Empty if the ceilings are not known.
std::vector<RooflineRow> rooflineRows(const BenchOptions& options, const BenchSummary& summary)
{
    std::vector<RooflineRow> rows;
    if (!summary.ceilings.known())
        return rows;
    const bool sorts_apart = std::any_of(summary.frames.begin(), summary.frames.end(),
                                         [](const TimedFrame& frame) { return frame.result.times.sort > 0; });
    const auto median = [&](const std::function<double(const TimedFrame&)>& value) {
        return spreadOf(summary.frames, value).median;
    };
    RooflineRow total{"frame", {}, {}, median([](const TimedFrame& frame) { return frame.result.times.total; })};
    for (const auto& stage : kRooflineStages) {
        RooflineRow row{stage.name, {}, {}, 0};
        for (double StageWork::*field : kWorkFields) {
            row.work.*field = median([&](const TimedFrame& frame) {
                const FrameWork work = leastWork(summary.anchor_cost, frame.result.eyes,
                                                 uint32_t(options.play.view.eyes), frame.pixels, sorts_apart);
                return work.*(stage.work).*field;
            });
            total.work.*field += row.work.*field;
        }
        row.measured_ms = median([&](const TimedFrame& frame) {
            const StageTimes& times = frame.result.times;
            // where projecting is a stage of its own, its work is still decode's
            return times.*(stage.time) + (stage.time == &StageTimes::decode ? times.project : 0);
        });
        row.floor = floorOf(row.work, summary.ceilings);
        total.floor.ms += row.floor.ms;
        rows.push_back(row);
    }
    rows.push_back(total);
    return rows;
}

Json configJson(const BenchOptions& options, const BenchSummary& summary)
{
    const PlayOptions& play = options.play;
    Json json = {{"cameras", play.cameras.file},
                 {"shots", summary.shots},
                 {"tier", tierName(summary.tier)},
                 {"eyes", play.view.eyes},
                 {"stereo", stereoName(play.frame.stereo)},
                 {"ipd", play.view.eyes == 2 ? unknownIfZero(summary.ipd) : Json()},
                 {"size", play.view.width > 0 ? Json{play.view.width, play.view.height} : Json()},
                 {"fov_degrees", unknownIfZero(play.view.fov_x * 180 / std::numbers::pi)},
                 {"near", unknownIfZero(play.frame.near_z)},
                 {"appearance", play.cameras.appearance >= 0 ? Json(play.cameras.appearance) : Json()},
                 {"threads", play.devices.threads},
                 {"vram_budget", play.devices.vram_budget > 0 ? Json(play.devices.vram_budget) : Json()},
                 {"reuse", toJson(reuseFacts(play.frame.reuse))},
                 {"frames_in_flight", options.in_flight},
                 {"warmup", options.warmup},
                 {"frames", options.measured}};
    json.update(lodJson(summary.frame, summary.frames));
    return json;
}

Json qualityJson(const BenchSummary& summary)
{
    const PooledDifference& quality = summary.quality;
    if (quality.frames == 0)
        return {};
    // equal images have no finite PSNR: null
    const auto decibels = [](double v) { return std::isfinite(v) ? Json(v) : Json(); };
    Json json = {{"reference", summary.reference},
                 {"images", quality.frames},
                 {"frames", summary.scored},
                 {"psnr_pooled", decibels(quality.psnr())},
                 {"psnr_worst", decibels(quality.worst_psnr)},
                 {"max_error", quality.max_error}};
    if (summary.fovea)
        json["fovea"] = toJson(*summary.fovea);
    return json;
}

Json rooflineJson(const BenchOptions& options, const BenchSummary& summary)
{
    const DeviceCeilings& ceilings = summary.ceilings;
    if (!ceilings.known())
        return {};
    Json stages;
    for (const RooflineRow& row : rooflineRows(options, summary))
        stages[row.name] = {{"bytes_read", row.work.bytes_read},
                            {"bytes_written", row.work.bytes_written},
                            {"lane_operations", row.work.lane_operations},
                            {"exponentials", row.work.exponentials},
                            {"matrix_flop", row.work.matrix_flop},
                            {"floor_ms", row.floor.ms},
                            {"measured_ms", row.measured_ms},
                            {"percent_of_ceiling", unknownIfZero(row.percent())},
                            {"bound", row.floor.bound == Bound::None ? Json() : Json(boundName(row.floor.bound))}};
    return {{"ceilings",
             {{"copy_bytes_per_s", ceilings.copy_bytes_per_s},
              {"read_bytes_per_s", ceilings.read_bytes_per_s},
              {"fma_lane_ops_per_s", ceilings.fma_lane_ops_per_s},
              {"exp_per_s", ceilings.exp_per_s},
              {"mma_flop_per_s", ceilings.mma_flop_per_s}}},
            {"stages", std::move(stages)}};
}

// Nothing if the ceilings are not known.
std::string rooflineText(const BenchOptions& options, const BenchSummary& summary)
{
    const DeviceCeilings& ceilings = summary.ceilings;
    const std::vector<RooflineRow> rows = rooflineRows(options, summary);
    if (rows.empty())
        return {};
    std::string text =
        formatString("ceilings of the device: copy %.2f TB/s, read %.2f TB/s, fp32 %.1f T lane "
                     "operations/s, exp %.2f T/s, fp16 matrix %.0f TFLOP/s\n",
                     ceilings.copy_bytes_per_s * 1e-12, ceilings.read_bytes_per_s * 1e-12,
                     ceilings.fma_lane_ops_per_s * 1e-12, ceilings.exp_per_s * 1e-12, ceilings.mma_flop_per_s * 1e-12);
    text += formatString("  %-16s %10s %12s %12s %10s %11s %10s  %s\n", "", "MB", "fp32 Gop", "matrix Gop", "floor ms",
                         "measured ms", "floor in %", "bound by");
    for (const RooflineRow& row : rows) {
        const StageWork& work = row.work;
        if (row.floor.ms == 0 && row.measured_ms == 0)
            continue; // a part of another stage
        text += formatString("  %-16s %10s %12s %12s %10s %11s %10.1f  %s\n", row.name,
                             formatMeasured((work.bytes_read + work.bytes_written) * 1e-6).c_str(),
                             formatMeasured(work.lane_operations * 1e-9).c_str(),
                             formatMeasured(work.matrix_flop * 1e-9).c_str(), formatMeasured(row.floor.ms).c_str(),
                             formatMeasured(row.measured_ms).c_str(), row.percent(),
                             row.floor.bound == Bound::None ? "-" : boundName(row.floor.bound));
    }
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

} // namespace

std::string benchReportJson(const BenchOptions& options, const BenchSummary& summary)
{
    Json ms = {{"open", summary.open_ms}, {"load", summary.load_ms}}, counts, cache, coarse;
    ms.update(toJson(timesOf(summary.frames)));
    for (const EyeCount& count : kEyeCounts)
        counts[count.name] = meanAndMax(countPerEye(summary.frames, options.play.view.eyes, count.field));
    for (const auto& count : kCacheCounts) // of decoded Gaussians, all eyes together
        cache[count.name] = meanAndMax(cacheCount(summary, count.field));
    for (const auto& count : kCoarseCounts) // each group once for all eyes
        coarse[count.name] = meanAndMax(groupsPerFrame(summary.frames, count.field));
    const Repeats repeats = repeatsOf(summary);
    double pixels = 0;
    for (const TimedFrame& frame : summary.frames)
        pixels += frame.pixels * options.play.view.eyes;
    const Json json = {
        {"schema", "gsc.bench/1"},
        {"tool", toJson(thisTool())},
        {"label", options.label},
        {"file", toJson(summary.file)},
        {"backend", summary.backend},
        {"device", toJson(summary.device)},
        {"config", configJson(options, summary)},
        {"ms", std::move(ms)},
        {"ns_per_gaussian", toJson(perGaussian(summary))},
        {"per_eye", std::move(counts)},
        {"cache", std::move(cache)},
        {"coarse", std::move(coarse)},
        {"roofline", rooflineJson(options, summary)},
        {"pixels_per_frame", pixels / double(std::max<size_t>(summary.frames.size(), 1))},
        {"peak_bytes", mostOf(summary.frames, &FrameResult::bytes_resident)},
        {"passes", meanAndMax(passesOf(summary))},
        {"frames_that_grew", grownFrames(summary)},
        {"repeats",
         {{"frames", repeats.frames},
          {"count", repeats.count},
          {"sum_ms", repeats.sum_ms},
          {"max_ms", repeats.max_ms}}},
        {"quality", qualityJson(summary)},
        {"workers", workersJson(summary.service)},
        {"warnings", summary.warnings},
    };
    return jsonText(json, -1);
}

std::string benchReportText(const BenchOptions& options, const BenchSummary& summary)
{
    const PlayOptions& play = options.play;
    const DeviceFacts& device = summary.device;
    std::string text = formatString("%s: %s, %s, %s, %s; %s", play.model.file.c_str(),
                                    formatCount(summary.file.anchors, "anchor").c_str(), summary.backend.c_str(),
                                    tierName(summary.tier), play.view.eyes == 2 ? "two eyes" : "one eye",
                                    device.name.empty() ? "unknown device" : device.name.c_str());
    if (!device.driver.empty())
        text += formatString(", driver %s", device.driver.c_str());
    if (device.clock_mhz > 0)
        text += formatString(", %.0f MHz, memory %.0f MHz", device.clock_mhz, device.memory_clock_mhz);
    text += formatString("\n%s after %s of warm-up, round %s\n", formatCount(summary.frames.size(), "frame").c_str(),
                         formatCount(options.warmup).c_str(), formatCount(summary.shots, "camera").c_str());
    text += formatString("  %-18s %12s %12s %12s %12s %12s\n", "milliseconds", "mean", "median", "p95", "p99", "max");
    const FrameTimes times = timesOf(summary.frames);
    text += tableRow("frame, wall", times.wall);
    text += tableRow("frame, device", times.device);
    for (size_t i = 0; i < std::size(kStages); ++i)
        text += tableRow(kStages[i].name, times.stages[i]);
    const Spread even = perGaussian(summary);
    text += tableRow("ns per Gaussian", even);
    text += formatString("time per Gaussian: p99 is %.2f times the median\ncounts per eye\n",
                         even.median > 0 ? even.p99 / even.median : 0.0);
    for (const EyeCount& count : kEyeCounts)
        text += countRow(count.name, countPerEye(summary.frames, play.view.eyes, count.field));
    if (play.frame.reuse.policy != ReusePolicy::None) {
        text += "cache of all eyes: bytes, entries dropped\n";
        for (const auto& count : kCacheCounts)
            text += countRow(count.name, cacheCount(summary, count.field));
    }
    if (summary.frame.detailPixels() > 0) {
        text += formatString("detail %g pixels: groups of all eyes\n", summary.frame.detailPixels());
        for (const auto& count : kCoarseCounts)
            text += countRow(count.name, groupsPerFrame(summary.frames, count.field));
    }
    text += targetText(summary.frame, summary.frames) + rooflineText(options, summary) + workersText(summary.service);
    text += formatString("peak memory %s", formatBytes(mostOf(summary.frames, &FrameResult::bytes_resident)).c_str());
    if (device.context_bytes > 0)
        text += formatString(", of which %s the driver's context", formatBytes(device.context_bytes).c_str());
    if (const Spread passes = passesOf(summary); passes.max > 1)
        text += formatString("; %.1f depth passes per frame, %.0f at most", passes.mean, passes.max);
    if (const uint32_t grown = grownFrames(summary); grown > 0)
        text += formatString("; %s enlarged a buffer, more --warmup avoids that",
                             formatCount(grown, "measured frame").c_str());
    if (const Repeats repeats = repeatsOf(summary); repeats.count > 0)
        text += formatString("\ndrawn again because a buffer was too small: %s, %s; they took %s of the device's "
                             "milliseconds above, %s at most in a frame",
                             formatCount(repeats.frames, "measured frame").c_str(),
                             formatCount(repeats.count, "repeat").c_str(), formatMeasured(repeats.sum_ms).c_str(),
                             formatMeasured(repeats.max_ms).c_str());
    if (summary.quality.frames > 0 && summary.quality.max_error == 0)
        text += formatString("\nagainst exact of %s, %s: identical", summary.reference.c_str(),
                             formatCount(summary.quality.frames, "image").c_str());
    else if (summary.quality.frames > 0)
        text += formatString("\nagainst exact of %s, %s: PSNR %s pooled, %s worst, largest error %.4g",
                             summary.reference.c_str(), formatCount(summary.quality.frames, "image").c_str(),
                             decibels(summary.quality.psnr(), " dB").c_str(),
                             decibels(summary.quality.worst_psnr, " dB").c_str(), summary.quality.max_error);
    text += "\n";
    return summary.fovea ? text + foveaText(*summary.fovea) : text;
}

} // namespace gsc
