// SPDX-License-Identifier: Apache-2.0
// The report of gsc-play bench, as JSON and as a table.
#include "player/measure/bench.h"

#include "format/error.h"
#include "player/report/report_parts.h"
#include "player/report/reuse_names.h"
#include "player/report/stage_names.h"
#include "runtime/frame_stats.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

namespace gsc {

namespace {

using Json = OrderedJson;

Spread spreadOf(const BenchSummary& summary, const std::function<double(const BenchFrame&)>& value)
{
    std::vector<double> values;
    for (const BenchFrame& frame : summary.frames)
        values.push_back(value(frame));
    return gsc::spreadOf(std::move(values));
}

constexpr struct {
    const char* name;
    uint64_t EyeCounts::*field;
} kCounts[] = {
    {"groups_tested", &EyeCounts::groups_tested},         {"anchors_tested", &EyeCounts::anchors_tested},
    {"anchors_visible", &EyeCounts::anchors_visible},     {"anchors_decoded", &EyeCounts::anchors_decoded},
    {"anchors_reused", &EyeCounts::anchors_reused},       {"anchors_overdue", &EyeCounts::anchors_overdue},
    {"gaussians_alive", &EyeCounts::gaussians_alive},     {"gaussians_visible", &EyeCounts::gaussians_visible},
    {"gaussians_dropped", &EyeCounts::gaussians_dropped}, {"pairs", &EyeCounts::pairs},
    {"blend_evaluations", &EyeCounts::blend_evaluations},
};

constexpr struct {
    const char* name;
    uint64_t FrameResult::*field;
} kCacheCounts[] = {
    {"cache_bytes", &FrameResult::cache_bytes},
    {"cache_evictions", &FrameResult::cache_evictions},
};

double gaussiansOf(const BenchFrame& frame, int eyes)
{
    double sum = 0;
    for (int e = 0; e < eyes; ++e)
        sum += double(frame.result.eyes[e].gaussians_visible);
    return std::max(sum, 1.0);
}

// Nanoseconds of device time per Gaussian on screen: how even the frames are once the path's own load is taken out.
Spread perGaussian(const BenchOptions& options, const BenchSummary& summary)
{
    return spreadOf(summary, [&](const BenchFrame& frame) {
        return frame.result.times.total * 1e6 / gaussiansOf(frame, options.play.eyes);
    });
}

Spread countOf(const BenchOptions& options, const BenchSummary& summary, uint64_t EyeCounts::*field)
{
    return spreadOf(summary, [&](const BenchFrame& frame) {
        double sum = 0;
        for (int e = 0; e < options.play.eyes; ++e)
            sum += double(frame.result.eyes[e].*field);
        return sum / options.play.eyes;
    });
}

uint64_t peakBytes(const BenchSummary& summary)
{
    uint64_t peak = 0;
    for (const BenchFrame& frame : summary.frames)
        peak = std::max(peak, frame.result.bytes_resident);
    return peak;
}

// Frames that had to enlarge a buffer; none after enough warm-up.
uint32_t grownFrames(const BenchSummary& summary)
{
    uint32_t grown = 0;
    uint64_t most = summary.warm_bytes;
    for (const BenchFrame& frame : summary.frames) {
        grown += most > 0 && frame.result.bytes_resident > most;
        most = std::max(most, frame.result.bytes_resident);
    }
    return grown;
}

// What drawing frames again cost. Where frames take several passes some are drawn again whatever the warm-up.
struct Repeats {
    uint32_t frames = 0;
    uint64_t count = 0;
    double sum_ms = 0, max_ms = 0; // device time; max: of one frame
};

Repeats repeatsOf(const BenchSummary& summary)
{
    Repeats repeats;
    for (const BenchFrame& frame : summary.frames) {
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
                                         [](const BenchFrame& frame) { return frame.result.times.sort > 0; });
    const auto median = [&](const std::function<double(const BenchFrame&)>& value) {
        return spreadOf(summary, value).median;
    };
    RooflineRow total{"frame", {}, {}, median([](const BenchFrame& frame) { return frame.result.times.total; })};
    for (const auto& stage : kRooflineStages) {
        RooflineRow row{stage.name, {}, {}, 0};
        for (double StageWork::*field : kWorkFields) {
            row.work.*field = median([&](const BenchFrame& frame) {
                const FrameWork work = leastWork(summary.anchor_cost, frame.result.eyes, uint32_t(options.play.eyes),
                                                 frame.pixels, sorts_apart);
                return work.*(stage.work).*field;
            });
            total.work.*field += row.work.*field;
        }
        row.measured_ms = median([&](const BenchFrame& frame) {
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

// Of decoded Gaussians, all eyes together.
Json cacheJson(const BenchSummary& summary)
{
    Json json;
    for (const auto& count : kCacheCounts) {
        const Spread s =
            spreadOf(summary, [&](const BenchFrame& frame) { return double(frame.result.*(count.field)); });
        json[count.name] = {{"mean", s.mean}, {"max", s.max}};
    }
    return json;
}

LodFacts lodFacts(const PlayOptions& play, const BenchSummary& summary)
{
    LodFacts lod{play.lod_bias, play.lod_fade, play.lod_hysteresis, play.target_ms, {}};
    for (const BenchFrame& frame : summary.frames)
        lod.used.push_back(frame.lod_bias);
    return lod;
}

Json configJson(const BenchOptions& options, const BenchSummary& summary)
{
    const PlayOptions& play = options.play;
    Json json = {{"cameras", play.cameras},
                 {"shots", summary.shots},
                 {"tier", tierName(summary.tier)},
                 {"eyes", play.eyes},
                 {"stereo", stereoName(play.stereo)},
                 {"ipd", play.eyes == 2 ? unknownIfZero(summary.ipd) : Json()},
                 {"size", play.width > 0 ? Json{play.width, play.height} : Json()},
                 {"fov_degrees", unknownIfZero(play.fov_x * 180 / std::numbers::pi)},
                 {"near", unknownIfZero(play.near_z)},
                 {"appearance", play.appearance >= 0 ? Json(play.appearance) : Json()},
                 {"threads", play.threads},
                 {"vram_budget", play.vram_budget > 0 ? Json(play.vram_budget) : Json()},
                 {"reuse", reuseJson(play.reuse)},
                 {"frames_in_flight", options.in_flight},
                 {"warmup", options.warmup},
                 {"frames", options.measured}};
    json.update(lodJson(lodFacts(play, summary)));
    return json;
}

Json qualityJson(const BenchSummary& summary)
{
    const PooledDifference& quality = summary.quality;
    if (quality.frames == 0)
        return {};
    // equal images have no finite PSNR: null
    const auto decibels = [](double v) { return std::isfinite(v) ? Json(v) : Json(); };
    return {{"reference", summary.reference},
            {"images", quality.frames},
            {"psnr_pooled", decibels(quality.psnr())},
            {"psnr_worst", decibels(quality.worst_psnr)},
            {"max_error", quality.max_error}};
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
    text += formatString("  %-16s %10s %12s %12s %10s %10s %8s  %s\n", "", "MB", "fp32 Gop", "matrix Gop", "floor",
                         "measured", "%", "bound by");
    for (const RooflineRow& row : rows) {
        const StageWork& work = row.work;
        if (row.floor.ms == 0 && row.measured_ms == 0)
            continue; // a part of another stage
        text += formatString("  %-16s %10.2f %12.3f %12.3f %10.4f %10.4f %8.1f  %s\n", row.name,
                             (work.bytes_read + work.bytes_written) * 1e-6, work.lane_operations * 1e-9,
                             work.matrix_flop * 1e-9, row.floor.ms, row.measured_ms, row.percent(),
                             row.floor.bound == Bound::None ? "-" : boundName(row.floor.bound));
    }
    return text;
}

std::string tableRow(const char* name, const Spread& s, int digits)
{
    return formatString("  %-16s %12.*f %12.*f %12.*f %12.*f %12.*f\n", name, digits, s.mean, digits, s.median, digits,
                        s.p95, digits, s.p99, digits, s.max);
}

} // namespace

std::string benchReportJson(const BenchOptions& options, const BenchSummary& summary)
{
    Json stages, counts;
    for (const auto& stage : kStages)
        stages[stage.name] =
            spreadJson(spreadOf(summary, [&](const BenchFrame& f) { return f.result.times.*(stage.field); }));
    for (const auto& count : kCounts) {
        const Spread s = countOf(options, summary, count.field);
        counts[count.name] = {{"mean", s.mean}, {"max", s.max}};
    }
    const Spread passes = spreadOf(summary, [](const BenchFrame& f) { return double(f.result.passes); });
    const Repeats repeats = repeatsOf(summary);
    double pixels = 0;
    for (const BenchFrame& frame : summary.frames)
        pixels += frame.pixels * options.play.eyes;
    const Json json = {
        {"schema", "gsc.bench/1"},
        {"tool", toolJson()},
        {"label", options.label},
        {"file", fileJson(options.play.input, summary.file_bytes, summary.anchors)},
        {"backend", summary.backend},
        {"device", deviceJson(summary.device)},
        {"config", configJson(options, summary)},
        {"ms",
         {{"open", summary.open_ms},
          {"load", summary.load_ms},
          {"wall", spreadJson(spreadOf(summary, [](const BenchFrame& f) { return f.wall_ms; }))},
          {"device", spreadJson(spreadOf(summary, [](const BenchFrame& f) { return f.result.times.total; }))},
          {"stages", std::move(stages)}}},
        {"ns_per_gaussian", spreadJson(perGaussian(options, summary))},
        {"per_eye", std::move(counts)},
        {"cache", cacheJson(summary)},
        {"roofline", rooflineJson(options, summary)},
        {"pixels_per_frame", pixels / double(std::max<size_t>(summary.frames.size(), 1))},
        {"peak_bytes", peakBytes(summary)},
        {"passes", {{"mean", passes.mean}, {"max", passes.max}}},
        {"frames_that_grew", grownFrames(summary)},
        {"repeats",
         {{"frames", repeats.frames},
          {"count", repeats.count},
          {"sum_ms", repeats.sum_ms},
          {"max_ms", repeats.max_ms}}},
        {"quality", qualityJson(summary)},
        {"warnings", summary.warnings},
    };
    return jsonText(json, -1);
}

std::string benchReportText(const BenchOptions& options, const BenchSummary& summary)
{
    const PlayOptions& play = options.play;
    const DeviceFacts& device = summary.device;
    std::string text = formatString("%s: %llu anchors, %s, %s, %s; %s", play.input.c_str(),
                                    static_cast<unsigned long long>(summary.anchors), summary.backend.c_str(),
                                    tierName(summary.tier), play.eyes == 2 ? "two eyes" : "one eye",
                                    device.name.empty() ? "unknown device" : device.name.c_str());
    if (!device.driver.empty())
        text += formatString(", driver %s", device.driver.c_str());
    if (device.clock_mhz > 0)
        text += formatString(", %.0f MHz, memory %.0f MHz", device.clock_mhz, device.memory_clock_mhz);
    text += formatString("\n%zu frames after %u of warm-up, round %llu cameras; milliseconds\n", summary.frames.size(),
                         options.warmup, static_cast<unsigned long long>(summary.shots));
    text += formatString("  %-16s %12s %12s %12s %12s %12s\n", "", "mean", "median", "p95", "p99", "max");
    text += tableRow("frame, wall", spreadOf(summary, [](const BenchFrame& f) { return f.wall_ms; }), 3);
    text += tableRow("frame, device", spreadOf(summary, [](const BenchFrame& f) { return f.result.times.total; }), 3);
    for (const auto& stage : kStages)
        text += tableRow(stage.name,
                         spreadOf(summary, [&](const BenchFrame& f) { return f.result.times.*(stage.field); }), 3);
    const Spread even = perGaussian(options, summary);
    text += tableRow("ns per Gaussian", even, 3);
    text += formatString("p99 of the time per Gaussian is %.2f times its median\nper eye\n",
                         even.median > 0 ? even.p99 / even.median : 0.0);
    for (const auto& count : kCounts)
        text += tableRow(count.name, countOf(options, summary, count.field), 0);
    if (play.reuse.policy != ReusePolicy::None) {
        text += "cache, all eyes\n";
        for (const auto& count : kCacheCounts)
            text += tableRow(
                count.name, spreadOf(summary, [&](const BenchFrame& f) { return double(f.result.*(count.field)); }), 0);
    }
    text += targetText(lodFacts(play, summary)) + rooflineText(options, summary);
    text += formatString("peak memory %.3f GiB", double(peakBytes(summary)) / double(1 << 30));
    if (device.context_bytes > 0)
        text += formatString(", of which %.3f the driver's context", double(device.context_bytes) / double(1 << 30));
    const Spread passes = spreadOf(summary, [](const BenchFrame& f) { return double(f.result.passes); });
    if (passes.max > 1)
        text += formatString("; %.1f depth passes per frame, %.0f at most", passes.mean, passes.max);
    if (const uint32_t grown = grownFrames(summary); grown > 0)
        text += formatString("; %u measured frames enlarged a buffer, more --warmup avoids that", grown);
    if (const Repeats repeats = repeatsOf(summary); repeats.count > 0)
        text += formatString(
            "\ndrawn again because a buffer was too small: %u measured frames, %llu repeats; they took "
            "%.3f of the device's milliseconds above, %.3f at most in a frame",
            repeats.frames, static_cast<unsigned long long>(repeats.count), repeats.sum_ms, repeats.max_ms);
    if (summary.quality.frames > 0 && summary.quality.max_error == 0)
        text += formatString("\nagainst exact of %s, %llu images: equal", summary.reference.c_str(),
                             static_cast<unsigned long long>(summary.quality.frames));
    else if (summary.quality.frames > 0)
        text +=
            formatString("\nagainst exact of %s, %llu images: PSNR %.2f dB pooled, %.2f dB worst, largest error %.5f",
                         summary.reference.c_str(), static_cast<unsigned long long>(summary.quality.frames),
                         summary.quality.psnr(), summary.quality.worst_psnr, summary.quality.max_error);
    return text + "\n";
}

} // namespace gsc
