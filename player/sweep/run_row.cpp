// SPDX-License-Identifier: Apache-2.0
#include "player/sweep/run_row.h"

#include "format/checksum.h"
#include "format/error.h"
#include "format/gsc_layout.h"
#include "format/file/mapped_file.h"
#include "player/report/report_parts.h"
#include "player/report/reuse_names.h"
#include "player/report/stage_names.h"
#include "runtime/frame_stats.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <numbers>

namespace gsc {

namespace {

// Sum of a count over the eyes of a frame.
double ofEyes(const RunFrame& frame, uint64_t EyeCounts::*field)
{
    double sum = 0;
    for (const EyeCounts& eye : frame.result.eyes) // of an eye that is not there all are 0
        sum += double(eye.*field);
    return sum;
}

std::vector<double> perFrame(const std::vector<RunFrame>& frames, const std::function<double(const RunFrame&)>& value)
{
    std::vector<double> values;
    for (const RunFrame& frame : frames)
        values.push_back(value(frame));
    return values;
}

std::vector<double> countPerFrame(const std::vector<RunFrame>& frames, uint64_t EyeCounts::*field)
{
    return perFrame(frames, [&](const RunFrame& frame) { return ofEyes(frame, field); });
}

uint64_t sumOf(const std::vector<double>& counts)
{
    double sum = 0;
    for (const double count : counts)
        sum += count;
    return uint64_t(sum);
}

OrderedJson integers(const std::vector<double>& counts)
{
    OrderedJson json = OrderedJson::array();
    for (const double count : counts)
        json.push_back(uint64_t(count));
    return json;
}

OrderedJson perFrameJson(const RunResult& result)
{
    OrderedJson psnr = OrderedJson::array(), temporal = OrderedJson::array();
    for (const double value : result.accuracy.frame_psnr)
        psnr.push_back(psnrJson(value));
    for (const double value : result.accuracy.frame_temporal)
        temporal.push_back(jsonNumber(value));
    return {{"wall_ms", perFrame(result.frames, [](const RunFrame& f) { return f.wall_ms; })},
            {"psnr", std::move(psnr)},
            {"temporal", std::move(temporal)},
            {"decoded", integers(countPerFrame(result.frames, &EyeCounts::anchors_decoded))}};
}

// Those after the first `warmup`, or the last one where there are no more.
std::vector<RunFrame> timedFrames(const std::vector<RunFrame>& frames, uint32_t warmup)
{
    return {frames.begin() + std::ptrdiff_t(std::min<size_t>(warmup, frames.size() - 1)), frames.end()};
}

// Every pose as the backend gets it.
void addPoses(const Path& path, Checksum64& sum)
{
    for (const Shot& shot : path.shots) {
        EyeParams eyes[kMaxEyes];
        std::memset(eyes, 0, sizeof(eyes)); // no stray bytes between fields
        shotEyes(shot, path.eye_count, eyes);
        sum.update(std::as_bytes(std::span(eyes)));
        sum.update(std::as_bytes(std::span(&shot.appearance, 1)));
    }
}

std::string idOf(const RunContext& context, const Path& path, const RunConfig& run)
{
    const PlayOptions& options = context.options;
    const OrderedJson said = {{"run", runKeyJson(run)},
                              {"trajectory", path.name},
                              {"frames", path.shots.size()},
                              {"warmup", context.warmup},
                              {"ssim", context.score.ssim_every},
                              {"flip", context.score.flip_every},
                              {"reference", context.reference},
                              {"near", options.near_z},
                              {"background", options.background ? OrderedJson(*options.background) : OrderedJson()},
                              {"threads", options.threads},
                              {"vram_budget", options.vram_budget}};
    const std::string text = jsonText(said, -1);
    Checksum64 sum;
    sum.update(std::as_bytes(std::span(text)));
    sum.update(std::as_bytes(std::span(&context.file_hash, 1)));
    addPoses(path, sum);
    return formatString("%016llx", static_cast<unsigned long long>(sum.digest()));
}

// "error 0.5 budget 2000": a run in a few words.
std::string shortName(const OrderedJson& config)
{
    std::string text = config.at("policy").get<std::string>();
    if (!config.at("max_depth").is_null())
        text += formatString(" %llu %.3s", static_cast<unsigned long long>(config.at("max_depth").get<uint64_t>()),
                             config.at("guidance").get<std::string>().c_str());
    if (!config.at("bound").is_null())
        text += formatString(" %g", config.at("bound").get<double>());
    if (!config.at("decode_budget").is_null())
        text +=
            formatString(" budget %llu", static_cast<unsigned long long>(config.at("decode_budget").get<uint64_t>()));
    if (!config.at("cache_budget").is_null())
        text += formatString(" cache %.0fM", config.at("cache_budget").get<double>() / double(1 << 20));
    if (const std::string stereo = config.at("stereo").get<std::string>(); stereo != stereoName(StereoMode::Exact))
        text += " " + stereo;
    if (const double bias = config.at("lod_bias").get<double>(); bias != 0)
        text += formatString(" lod%+g", bias);
    if (const double fade = config.value("lod_fade", 0.0); fade != 0)
        text += formatString(" fade %g", fade);
    if (const double lag = config.value("lod_hysteresis", 0.0); lag != 0)
        text += formatString(" lag %g", lag);
    return text;
}

std::string decibels(const OrderedJson& psnr)
{
    return psnr.is_null() ? "equal" : formatString("%.2f", psnr.get<double>());
}

} // namespace

uint64_t fileHash(const std::string& path)
{
    const MappedFile file(path);
    FileHeader header{};
    std::memcpy(&header, file.bytes().data(), std::min(sizeof(header), file.bytes().size()));
    return header.header_checksum;
}

OrderedJson runConfigJson(const RunContext& context, const Path& path, const RunConfig& run)
{
    const PlayOptions& options = context.options;
    OrderedJson json = {{"id", idOf(context, path, run)}, {"trajectory", path.name},  {"cameras", path.cameras},
                        {"frames", path.shots.size()},    {"warmup", context.warmup}, {"cold", true}};
    json.update(reuseJson(run.reuse));
    json.update(
        OrderedJson{{"tier", tierName(run.tier)},
                    {"lod_bias", run.lod_bias},
                    {"lod_fade", run.lod_fade},
                    {"lod_hysteresis", run.lod_hysteresis},
                    {"stereo", stereoName(run.stereo)},
                    {"eyes", path.eye_count},
                    {"ipd", path.eye_count == 2 ? unknownIfZero(path.shots.front().ipd) : OrderedJson()},
                    {"size", options.width > 0 ? OrderedJson{options.width, options.height} : OrderedJson()},
                    {"fov_degrees", unknownIfZero(options.fov_x * 180 / std::numbers::pi)},
                    {"near", unknownIfZero(options.near_z)},
                    {"appearance", options.appearance >= 0 ? OrderedJson(options.appearance) : OrderedJson()},
                    {"threads", options.threads},
                    {"vram_budget", options.vram_budget > 0 ? OrderedJson(options.vram_budget) : OrderedJson()}});
    return json;
}

OrderedJson reuseCountsJson(const std::vector<RunFrame>& frames)
{
    const std::vector<double> decoded = countPerFrame(frames, &EyeCounts::anchors_decoded);
    const std::vector<double> reused = countPerFrame(frames, &EyeCounts::anchors_reused);
    const auto visible = double(sumOf(countPerFrame(frames, &EyeCounts::anchors_visible)));
    uint64_t evictions = 0, cache_bytes = 0;
    for (const RunFrame& frame : frames) {
        evictions += frame.result.cache_evictions;
        cache_bytes = std::max(cache_bytes, frame.result.cache_bytes);
    }
    return {{"decoded_per_frame", spreadJson(spreadOf(decoded))},
            {"reused_per_frame", spreadJson(spreadOf(reused))},
            {"hit_rate", visible > 0 ? double(sumOf(reused)) / visible : 0.0},
            {"overdue", sumOf(countPerFrame(frames, &EyeCounts::anchors_overdue))},
            {"evictions", evictions},
            {"cache_bytes", cache_bytes}};
}

OrderedJson timesJson(const std::vector<RunFrame>& frames, uint32_t warmup)
{
    const std::vector<RunFrame> measured = timedFrames(frames, warmup);
    OrderedJson stages;
    for (const auto& stage : kStages)
        stages[stage.name] =
            spreadJson(spreadOf(perFrame(measured, [&](const RunFrame& f) { return f.result.times.*(stage.field); })));
    return {
        {"wall", spreadJson(spreadOf(perFrame(measured, [](const RunFrame& f) { return f.wall_ms; })))},
        {"device", spreadJson(spreadOf(perFrame(measured, [](const RunFrame& f) { return f.result.times.total; })))},
        {"stages", std::move(stages)}};
}

OrderedJson runRowJson(const RunContext& context, OrderedJson config, const RunConfig& run, const RunResult& result)
{
    uint64_t peak = 0, repeats = 0;
    for (const RunFrame& frame : result.frames)
        peak = std::max(peak, frame.result.bytes_resident);
    for (const RunFrame& frame : timedFrames(result.frames, context.warmup))
        repeats += frame.result.repeats;
    return {{"schema", "gsc.run/1"},
            {"tool", toolJson()},
            {"label", context.label},
            {"file", fileJson(context.options.input, context.file_bytes, context.anchors)},
            {"backend", run.backend},
            {"reference", context.reference},
            {"device", deviceJson(result.device)},
            {"config", std::move(config)},
            {"rendered_tier", tierName(result.tier)},
            {"ms", timesJson(result.frames, context.warmup)},
            {"accuracy", accuracyJson(result.accuracy)},
            {"reuse", reuseCountsJson(result.frames)},
            {"peak_bytes", peak},
            {"repeats", repeats},
            {"per_frame", perFrameJson(result)}};
}

std::string runTableHeader()
{
    return formatString("%-14s %-8s %-32s %9s %9s %9s %8s %8s %8s %8s %7s %9s\n", "trajectory", "backend", "reuse",
                        "ms", "p99", "decode", "PSNR", "p1", "worst", "flicker", "hits %", "cache MiB");
}

std::string runTableLine(const OrderedJson& row)
{
    const OrderedJson& config = row.at("config");
    const OrderedJson& ms = row.at("ms");
    const OrderedJson& psnr = row.at("accuracy").at("psnr");
    const OrderedJson& temporal = row.at("accuracy").at("temporal");
    return formatString("%-14s %-8s %-32s %9.2f %9.2f %9.2f %8s %8s %8s %8s %7.1f %9.1f\n",
                        config.at("trajectory").get<std::string>().c_str(),
                        row.at("backend").get<std::string>().c_str(), shortName(config).c_str(),
                        ms.at("wall").at("median").get<double>(), ms.at("wall").at("p99").get<double>(),
                        ms.at("stages").at("decode").at("median").get<double>(), decibels(psnr.at("pooled")).c_str(),
                        decibels(psnr.at("p1")).c_str(), decibels(psnr.at("min")).c_str(),
                        temporal.is_null() ? "-" : formatString("%.4f", temporal.at("p99").get<double>() * 255).c_str(),
                        100 * row.at("reuse").at("hit_rate").get<double>(),
                        row.at("reuse").at("cache_bytes").get<double>() / double(1 << 20));
}

} // namespace gsc
