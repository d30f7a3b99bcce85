// SPDX-License-Identifier: Apache-2.0
#include "player/measure/run_facts.h"

#include <gsc/checksum.h>
#include <gsc/error.h>
#include "player/devices/worker_options.h"
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
    OrderedJson workers = OrderedJson::array(); // each keeps entries of its own
    if (drawsWithService(context.devices))
        for (const DeviceId& device : workerDevices(context.devices))
            workers.push_back(device.backend);
    const std::string mode = workers.empty() ? std::string() : serviceModeName(context.devices.workers.mode);
    OrderedJson said = {{"run", runKeyJson(run)},
                        {"trajectory", path.name},
                        {"frames", path.shots.size()},
                        {"warmup", context.warmup},
                        {"measured", context.measured},
                        {"in_flight", context.in_flight},
                        {"workers", std::move(workers)},
                        {"mode", mode},
                        {"ssim", context.score.ssim_every},
                        {"flip", context.score.flip_every},
                        {"scored", {context.score.first, context.score.every, context.score.listed}},
                        {"reference", context.reference},
                        {"near", run.near_z},
                        {"background", run.background ? OrderedJson(*run.background) : OrderedJson()},
                        {"threads", context.devices.threads},
                        {"vram_budget", context.devices.vram_budget}};
    if (context.until_steady > 0)
        said["until_steady"] = context.until_steady;
    const std::string text = jsonText(said, -1);
    Checksum64 sum;
    sum.update(std::as_bytes(std::span(text)));
    sum.update(std::as_bytes(std::span(&context.file_hash, 1)));
    addPoses(path.shots, path.eye_count, sum);
    return hashText(sum.digest());
}

} // namespace

OrderedJson runKeyJson(const RunConfig& run)
{
    OrderedJson json = {{"backend", run.backend},
                        {"tier", tierName(run.tier)},
                        {"lod_bias", run.lod_bias + 0.0},
                        {"lod_fade", run.lod_fade},
                        {"lod_hysteresis", run.lod_hysteresis},
                        {"detail", run.detailPixels()},
                        {"fovea_pixels", run.foveaPixels()},
                        {"target_ms", run.target_ms},
                        {"stereo", stereoName(run.stereo)}};
    json.update(toJson(reuseFacts(run.reuse)));
    if (run.match_budget)
        json["decode_budget"] = "match";
    return json;
}

RowConfig rowConfig(const RunContext& context, const Path& path, const RunConfig& run)
{
    RowConfig config;
    config.id = idOf(context, path, run);
    config.trajectory = path.name;
    config.cameras = path.cameras;
    config.shots = path.shots.size();
    config.frames = context.measured > 0 ? context.measured : path.shots.size();
    config.warmup = context.warmup;
    config.cold = context.measured == 0 || context.warmup == 0;
    config.frames_in_flight = context.in_flight;
    config.reuse = reuseFacts(run.reuse);
    config.tier = tierName(run.tier);
    config.lod_bias = run.lod_bias;
    config.lod_fade = run.lod_fade;
    config.lod_hysteresis = run.lod_hysteresis;
    config.detail = run.detailPixels();
    config.fovea_pixels = run.foveaPixels();
    config.target_ms = run.target_ms;
    config.stereo = stereoName(run.stereo);
    config.eyes = path.eye_count;
    config.ipd = path.eye_count == 2 ? path.shots.front().ipd : 0;
    if (context.view.width > 0) // one side may be given alone
        config.size = {path.shots.front().camera.width, path.shots.front().camera.height};
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

RunRow runRow(const RunContext& context, const RowConfig& config, const std::string& backend, const RunResult& result)
{
    const TimedFrames timed = timedFrames(result.frames, config.cold ? uint32_t(config.warmup) : 0);
    RunRow row;
    row.tool = thisTool();
    row.label = context.label;
    row.file = context.file;
    row.backend = backend;
    row.device = result.device;
    row.config = config;
    row.rendered_tier = tierName(result.tier);
    row.ms = timesOf(timed);
    if (result.accuracy.images > 0) {
        row.reference = context.reference;
        row.accuracy = result.accuracy;
    }
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

} // namespace gsc
