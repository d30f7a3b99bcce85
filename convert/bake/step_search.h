// SPDX-License-Identifier: Apache-2.0
// How coarse a model may be: one knob, the error that a value may cost, turned until pictures keep a target.
#pragma once

#include "convert/bake/model/reduced_model.h"
#include "convert/bake/pictures/picture_probe.h"

#include <cstddef>
#include <cstdint>
#include <functional>

namespace gsc {

// Other poses than those of the search keep a target that those keep with this much to spare, dB.
constexpr double kSearchMargin = 0.6;

// Score of a model baked as the plan says, from the poses [first, first + count); those of the search come first.
using PlanScore = std::function<SetScore(const BakePlan& plan, size_t first, size_t count)>;

struct SearchTask {
    const ModelParams& params;
    uint64_t anchors;
    PlanScore score;
    size_t poses;
    uint64_t weight_pixels; // of the poses that importance was found from
    uint32_t levers;
    double target = 0, min_view = 0; // dB
    double margin = kSearchMargin;   // dB above both that are aimed at
    const BakePlan* from = nullptr;  // where to begin, its costs measured already
};

struct SearchResult {
    BakePlan plan;
    SetScore score; // of the plan
    bool kept = false;
    uint32_t probes = 0;
};

// The largest error that keeps the target and a margin above it.
[[nodiscard]] SearchResult searchSteps(const SearchTask& task);
// At most, for a bar that knows the whole.
[[nodiscard]] size_t searchPictures(size_t poses);

} // namespace gsc
