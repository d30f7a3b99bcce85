// SPDX-License-Identifier: Apache-2.0
// Costs of models at several qualities, as `gsc bake --curve` writes them: lines of gsc.curve/1.
#pragma once

#include "runtime/records/report_parts.h"

#include <cmath>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace gsc {

// One line: a model itself, or baked to a target.
struct CurveRow {
    std::string schema = "gsc.curve/1";
    ToolFacts tool;
    std::string model, device, tier;
    uint64_t most_pixels = 0;   // of a picture that judged
    uint64_t model_anchors = 0; // of the model itself
    double target_psnr = -1;    // dB; -1: the model itself
    uint64_t anchors = 0, bytes = 0, archive_bytes = 0, resident_bytes = 0;
    double frame_ms = 0, decode_ms = 0; // medians
    std::vector<double> detail_ms;      // of kTimedDetails; none: an earlier version has not told
    uint64_t poses = 0;
    double psnr = INFINITY, worst_psnr = INFINITY; // dB, INFINITY: equal
    std::string worst;                             // pose
    double ssim = 1, worst_ssim = 1, flip = 0, worst_flip = 0;
};
// Written and read by the same lines.
void describe(const Record& at, CurveRow& row);

// The lines of a model on a device, in the order that they came.
struct ChartCurve {
    std::vector<CurveRow> rows;
};

// Does it begin with a curve?
bool isCurveText(std::string_view text);

// Adds the lines of `text`; `path` names it in messages. Throws Error(InvalidFile, Unsupported, Interrupted).
void addCurves(std::string_view text, const std::string& path, std::vector<ChartCurve>& curves);

} // namespace gsc
