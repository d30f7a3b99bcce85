// SPDX-License-Identifier: Apache-2.0
// What a model costs at several qualities: bytes, memory and time against pictures.
#pragma once

#include "convert/bake/bake.h"

#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace gsc {

struct CurvePoint {
    std::optional<double> target; // dB; none: the model itself
    uint64_t anchors = 0;
    BakeSizes sizes;
    FileScore score; // against the model itself, from the poses of the verdict
};

struct Curve {
    uint64_t anchors = 0;              // of the model
    std::string device;                // what drew
    std::vector<CurvePoint> points;    // the model, then the targets that can be kept, in the order asked for
    std::vector<std::string> warnings; // targets that cannot be kept and why; what was passed over
    uint64_t pictures_kept = 0;        // that a bake before had drawn for BakeOptions::resume
    double seconds = 0;
};

// Bakes to each of `targets`, as bake() would one by one; BakeOptions::output is not used. `scratch`: a file that is
// made and removed for each. BakeOptions::resume stays: it is the caller's to remove when the curve is written. Throws as
// bake(); Difference where no target can be kept.
[[nodiscard]] Curve bakeCurve(const BakeOptions& options, const std::vector<double>& targets,
                              const std::string& scratch, const BakeProgress& progress);

} // namespace gsc
