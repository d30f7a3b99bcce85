// SPDX-License-Identifier: Apache-2.0
#include "convert/chart/rows/curve_set.h"

#include <gsc/error.h>

#include <algorithm>

namespace gsc {

void addCurveRow(RunRow row, const std::string& where, std::vector<ChartCurve>& curves)
{
    if (!row.accuracy)
        throw Error(ErrorCode::InvalidFile, where, "has no accuracy", "a row of gsc bake --curve",
                    "remove the line or write the curve again");
    const auto keyOf = [](const RunRow& of) {
        return std::make_tuple(of.file.path, of.backend, of.config.tier, of.curve->most_pixels,
                               of.curve->model_anchors);
    };
    const double target = row.curve->target_psnr;
    const auto found =
        std::ranges::find_if(curves, [&](const ChartCurve& curve) { return keyOf(curve.rows.front()) == keyOf(row); });
    ChartCurve& curve = found == curves.end() ? curves.emplace_back() : *found;
    if (curve.rows.empty() && target >= 0)
        throw Error(ErrorCode::InvalidFile, where, formatString("%s at %g dB", row.file.path.c_str(), target),
                    "a line of the model itself, without a target, before it", "write the curve again");
    if (std::ranges::any_of(curve.rows, [&](const RunRow& other) { return other.curve->target_psnr == target; }))
        throw Error(ErrorCode::InvalidFile, where, row.file.path + " has such a line already", "each target once",
                    "pass each file once");
    curve.rows.push_back(std::move(row));
}

} // namespace gsc
