// SPDX-License-Identifier: Apache-2.0
#include "convert/bake/curve.h"

#include <gsc/error.h>

#include <chrono>
#include <filesystem>

namespace gsc {

Curve bakeCurve(const BakeOptions& options, const std::vector<double>& targets, const std::string& scratch,
                const BakeProgress& progress)
{
    const auto start = std::chrono::steady_clock::now();
    BakeOptions same = options;
    same.target_psnr = targets.front(); // that there is one is all that counts here
    same.overwrite = true;
    Baker baker(same, progress, targets);
    Curve curve;
    curve.anchors = baker.prepared().anchors;
    curve.device = baker.prepared().device;
    curve.warnings = baker.prepared().warnings;
    curve.points.push_back({std::nullopt, curve.anchors, baker.prepared().before, baker.measure(options.input)});
    for (const double target : targets) {
        try {
            const BakeReport report = baker.bakeTo(scratch, target, options.min_view_psnr);
            curve.points.push_back(
                {target, report.anchors - report.anchors_left_out, report.after, baker.measure(scratch)});
            curve.pictures_kept = report.pictures_kept;
        } catch (const Error& error) {
            if (error.code() != ErrorCode::Difference || (curve.points.size() == 1 && target == targets.back()))
                throw;
            curve.warnings.push_back(error.what());
        }
    }
    std::error_code ignored; // its folder is removed too
    std::filesystem::remove(scratch, ignored);
    curve.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return curve;
}

} // namespace gsc
