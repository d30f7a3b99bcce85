// SPDX-License-Identifier: Apache-2.0
#include "convert/commands/bake/bake_report.h"

#include "runtime/cli/version.h"
#include "runtime/records/reuse_names.h"
#include "runtime/records/run_row.h"

#include <gsc/checksum.h>
#include <gsc/frame_stats.h>

#include <cmath>

namespace gsc {

namespace {

RunRow pointRow(const std::string& name, const BakeOptions& options, const Curve& curve, const CurvePoint& point)
{
    const FileScore& score = point.score;
    RunRow row;
    row.tool = {"gsc", toolVersion(), toolCommit()};
    row.file = {name, point.sizes.file, point.anchors};
    row.backend = row.reference = curve.device;
    row.device = score.device;
    row.config.trajectory = "verdict";
    row.config.cameras = options.cameras.empty() ? "stored" : options.cameras.front();
    row.config.shots = row.config.frames = score.frames.size();
    row.config.reuse = reuseFacts({});
    row.config.tier = row.rendered_tier = tierName(Tier::Exact);
    row.config.stereo = stereoName(StereoMode::Exact);
    row.config.threads = options.threads;
    row.ms = timesOf(score.frames);
    row.accuracy = score.accuracy;
    row.reuse = reuseCounts(score.frames);
    row.peak_bytes = score.resident_bytes;
    for (const TimedFrame& frame : score.frames) {
        row.repeats += frame.result.repeats;
        row.wall_ms.push_back(frame.wall_ms);
        row.decoded.push_back(ofEyes(frame, &EyeCounts::anchors_decoded));
    }
    row.curve = {point.target.value_or(-1), curve.anchors,    options.limits.most_pixels,
                 point.sizes.archive.file,  score.worst_pose, score.detail_ms};
    const std::string key = jsonText({{"file", toJson(row.file)}, {"curve", toJson(*row.curve)}}, -1);
    row.config.id = hashText(checksum64(std::as_bytes(std::span(key))));
    return row;
}

std::string psnrText(double value)
{
    return std::isfinite(value) ? formatString("%.2f", value) : value > 0 ? "identical" : "no number";
}

std::string targetText(const CurvePoint& point)
{
    return point.target ? formatString("%g", *point.target) : "whole";
}

std::string detailText(const Curve& curve)
{
    std::string text =
        "a viewer who stops at each pose, tier fast: milliseconds of a frame by detail in pixels\ntarget";
    for (const unsigned detail : kTimedDetails)
        text += formatString(" %9u", detail);
    text += "\n";
    for (const CurvePoint& point : curve.points) {
        text += formatString("%6s", targetText(point).c_str());
        for (const double ms : point.score.detail_ms)
            text += formatString(" %9.2f", ms);
        text += "\n";
    }
    return text;
}

} // namespace

std::string curveLines(const std::string& name, const BakeOptions& options, const Curve& curve)
{
    std::string lines;
    for (const CurvePoint& point : curve.points)
        lines += jsonText(toJson(pointRow(name, options, curve, point)), -1) + "\n";
    return lines;
}

Json curveJson(const std::string& name, const BakeOptions& options, const std::string& output, const Curve& curve)
{
    Json points = Json::array();
    for (const CurvePoint& point : curve.points)
        points.push_back(toJson(pointRow(name, options, curve, point)));
    return {{"schema", "gsc.curve-report/1"},
            {"generator", {{"name", "gsc"}, {"version", toolVersion()}}},
            {"path", options.name},
            {"output", output},
            {"points", std::move(points)},
            {"seconds", jsonNumber(curve.seconds)},
            {"peak_memory_bytes", peakMemoryBytes()}};
}

std::string curveText(const std::string& output, const Curve& curve)
{
    std::string text = formatString("wrote       %s; drawn by %s, tier exact\n", output.c_str(), curve.device.c_str());
    text += "target   archive  an anchor    resident  frame ms  decode ms    pooled     worst    SSIM    FLIP\n    dB  "
            "                                                           dB        dB\n";
    for (const CurvePoint& point : curve.points) {
        const Accuracy& accuracy = point.score.accuracy;
        const FrameTimes times = timesOf(point.score.frames);
        text += formatString("%6s %9s %8.1f B %11s %9.2f %10.2f %9s %9s %7.4f %7.4f\n", targetText(point).c_str(),
                             formatBytes(point.sizes.archive.file).c_str(),
                             double(point.sizes.archive.file) / double(curve.anchors),
                             formatBytes(point.score.resident_bytes).c_str(), times.device.median,
                             times.stages[kDecodeStage].median, psnrText(accuracy.psnr_pooled).c_str(),
                             psnrText(accuracy.psnr_min).c_str(), accuracy.ssim.mean, accuracy.flip.mean);
    }
    return text + detailText(curve);
}

} // namespace gsc
