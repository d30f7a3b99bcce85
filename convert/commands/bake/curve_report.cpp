// SPDX-License-Identifier: Apache-2.0
#include "convert/commands/bake/bake_report.h"

#include "convert/chart/rows/curve_set.h"
#include "runtime/cli/version.h"
#include "runtime/records/timed_details.h"

#include <cmath>

namespace gsc {

namespace {

Json pointJson(const std::string& name, const BakeOptions& options, const Curve& curve, const CurvePoint& point)
{
    const FileScore& score = point.score;
    CurveRow row;
    row.tool = {"gsc", toolVersion(), toolCommit()};
    row.model = name;
    row.device = curve.device;
    row.tier = "exact";
    row.most_pixels = options.limits.most_pixels;
    row.model_anchors = curve.anchors;
    row.target_psnr = point.target.value_or(-1);
    row.anchors = point.anchors;
    row.bytes = point.sizes.file;
    row.archive_bytes = point.sizes.archive.file;
    row.resident_bytes = score.resident_bytes;
    row.frame_ms = score.frame_ms;
    row.decode_ms = score.decode_ms;
    row.detail_ms = score.detail_ms;
    row.poses = score.set.poses.size();
    row.psnr = score.set.psnr;
    row.worst_psnr = score.set.worstPose().psnr;
    row.worst = score.set.worstPose().name;
    row.ssim = score.ssim;
    row.worst_ssim = score.worst_ssim;
    row.flip = score.flip;
    row.worst_flip = score.worst_flip;
    return toJson(row);
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
        lines += pointJson(name, options, curve, point).dump() + "\n";
    return lines;
}

Json curveJson(const std::string& name, const BakeOptions& options, const std::string& output, const Curve& curve)
{
    Json points = Json::array();
    for (const CurvePoint& point : curve.points)
        points.push_back(pointJson(name, options, curve, point));
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
    for (const CurvePoint& point : curve.points)
        text += formatString("%6s %9s %8.1f B %11s %9.2f %10.2f %9s %9s %7.4f %7.4f\n", targetText(point).c_str(),
                             formatBytes(point.sizes.archive.file).c_str(),
                             double(point.sizes.archive.file) / double(curve.anchors),
                             formatBytes(point.score.resident_bytes).c_str(), point.score.frame_ms,
                             point.score.decode_ms, psnrText(point.score.set.psnr).c_str(),
                             psnrText(point.score.set.worstPose().psnr).c_str(), point.score.ssim, point.score.flip);
    return text + detailText(curve);
}

} // namespace gsc
