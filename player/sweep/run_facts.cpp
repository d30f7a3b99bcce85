// SPDX-License-Identifier: Apache-2.0
#include "player/sweep/run_facts.h"

#include <gsc/checksum.h>
#include <gsc/error.h>
#include "player/frames/content_hash.h"
#include "runtime/records/reuse_names.h"
#include <gsc/frame_stats.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>

namespace gsc {

namespace {

std::string idOf(const RunContext& context, const Path& path, const RunConfig& run)
{
    OrderedJson said = {{"run", runKeyJson(run)},
                        {"trajectory", path.name},
                        {"frames", path.shots.size()},
                        {"warmup", context.warmup},
                        {"ssim", context.score.ssim_every},
                        {"flip", context.score.flip_every},
                        {"reference", context.reference},
                        {"near", run.near_z},
                        {"background", run.background ? OrderedJson(*run.background) : OrderedJson()},
                        {"threads", context.devices.threads},
                        {"vram_budget", context.devices.vram_budget}};
    if (context.score.every > 1 || context.score.first > 0) // runs that score all keep the ids that they had
        said["scored"] = {context.score.first, context.score.every};
    const std::string text = jsonText(said, -1);
    Checksum64 sum;
    sum.update(std::as_bytes(std::span(text)));
    sum.update(std::as_bytes(std::span(&context.file_hash, 1)));
    addPoses(path.shots, path.eye_count, sum);
    return hashText(sum.digest());
}

// "error 0.5 budget 2000": a run in a few words.
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

} // namespace

RowConfig rowConfig(const RunContext& context, const Path& path, const RunConfig& run)
{
    RowConfig config;
    config.id = idOf(context, path, run);
    config.trajectory = path.name;
    config.cameras = path.cameras;
    config.frames = path.shots.size();
    config.warmup = context.warmup;
    config.reuse = reuseFacts(run.reuse);
    config.tier = tierName(run.tier);
    config.lod_bias = run.lod_bias;
    config.lod_fade = run.lod_fade;
    config.lod_hysteresis = run.lod_hysteresis;
    config.detail = run.detail;
    config.fovea_pixels = run.foveaPixels();
    config.stereo = stereoName(run.stereo);
    config.eyes = path.eye_count;
    config.ipd = path.eye_count == 2 ? path.shots.front().ipd : 0;
    config.size = {context.view.width, context.view.height};
    config.fov_degrees = context.view.fov_x * 180 / std::numbers::pi;
    config.near_z = run.near_z;
    config.appearance = context.appearance;
    config.threads = context.devices.threads;
    config.vram_budget = context.devices.vram_budget;
    return config;
}

uint64_t sweepHash(const RunContext& context, const std::vector<std::string>& ids)
{
    const std::string text = jsonText({{"tool", toJson(thisTool())}, {"label", context.label}, {"ids", ids}}, -1);
    return checksum64(std::as_bytes(std::span(text)));
}

RunRow runRow(const RunContext& context, const RowConfig& config, const RunConfig& run, const RunResult& result)
{
    const TimedFrames timed = timedFrames(result.frames, context.warmup);
    RunRow row;
    row.tool = thisTool();
    row.label = context.label;
    row.file = context.file;
    row.backend = run.backend;
    row.reference = context.reference;
    row.device = result.device;
    row.config = config;
    row.rendered_tier = tierName(result.tier);
    row.ms = timesOf(timed);
    row.accuracy = result.accuracy;
    row.reuse = reuseCounts(result.frames);
    row.peak_bytes = mostOf(result.frames, &FrameResult::bytes_resident);
    for (const TimedFrame& frame : timed)
        row.repeats += frame.result.repeats;
    for (const TimedFrame& frame : result.frames) {
        row.wall_ms.push_back(frame.wall_ms);
        row.decoded.push_back(ofEyes(frame, &EyeCounts::anchors_decoded));
    }
    return row;
}

std::string runTableHeader()
{
    return formatString("%-14s %-8s %-32s %9s %9s %9s %9s %9s %9s %13s %7s %9s\n", "trajectory", "backend", "reuse",
                        "ms", "p99 ms", "decode ms", "PSNR dB", "p1 dB", "worst dB", "flicker 1/255", "hits %",
                        "cache MiB");
}

std::string runTableLine(const RunRow& row)
{
    const Accuracy& accuracy = row.accuracy;
    const std::string line =
        formatString("%-14s %-8s %-32s %9.2f %9.2f %9.2f %9s %9s %9s %13s %7.1f %9.1f\n", row.config.trajectory.c_str(),
                     row.backend.c_str(), shortName(row.config).c_str(), row.ms.wall.median, row.ms.wall.p99,
                     row.ms.stages[kDecodeStage].median, decibels(boundedPsnr(accuracy.psnr_pooled)).c_str(),
                     decibels(boundedPsnr(accuracy.psnr_p1)).c_str(), decibels(boundedPsnr(accuracy.psnr_min)).c_str(),
                     accuracy.temporal.images == 0 ? "-" : formatString("%.4f", accuracy.temporal.p99 * 255).c_str(),
                     100 * row.reuse.hit_rate, double(row.reuse.cache_bytes) / double(1 << 20));
    return line + (accuracy.fovea ? "    " + foveaText(*accuracy.fovea) : "");
}

} // namespace gsc
