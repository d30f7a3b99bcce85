// SPDX-License-Identifier: Apache-2.0
#include "convert/reduce/curve.h"

#include <gsc/error.h>

#include <chrono>
#include <filesystem>

namespace gsc {

Curve bakeCurve(const ReduceOptions& options, const std::vector<double>& targets, const std::string& scratch,
                const ReduceProgress& progress)
{
    const auto start = std::chrono::steady_clock::now();
    ReduceOptions same = options;
    same.target_psnr = targets.front(); // that there is one is all that counts here
    same.overwrite = true;
    Reducer reducer(same, progress, targets);
    Curve curve;
    curve.anchors = reducer.prepared().anchors;
    curve.device = reducer.prepared().device;
    curve.warnings = reducer.prepared().warnings;
    curve.points.push_back({std::nullopt, curve.anchors, reducer.prepared().before, reducer.measure(options.input)});
    for (const double target : targets) {
        try {
            const ReduceReport report = reducer.bakeTo(scratch, target, options.min_view_psnr);
            curve.points.push_back(
                {target, report.anchors - report.anchors_left_out, report.after, reducer.measure(scratch)});
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
