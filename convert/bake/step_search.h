// SPDX-License-Identifier: Apache-2.0
// Search for the coarsest values that keep a target: varies one number, the error that rounding a value may cost.
#pragma once

#include "convert/bake/model/reduced_model.h"
#include "convert/bake/pictures/picture_probe.h"

#include <cstddef>
#include <cstdint>
#include <functional>

namespace gsc {

// Margin of the search above the target, dB: enough that poses of the verdict keep the target, too.
constexpr double kSearchMargin = 0.6;

// Scores a model baked by the plan, from the poses [first, first + count); poses of the search come first.
using PlanScore = std::function<SetScore(const BakePlan& plan, size_t first, size_t count)>;

struct SearchTask {
    const ModelParams& params;
    uint64_t anchors;
    PlanScore score;
    size_t poses;
    uint64_t weight_pixels; // pixels of the poses that importance was found from
    uint32_t levers;
    double target = 0, min_view = 0; // dB
    double margin = kSearchMargin;   // dB above both to aim at
    const BakePlan* from = nullptr;  // plan to start from, with measured costs
};

struct SearchResult {
    BakePlan plan;
    SetScore score; // score of the plan
    bool kept = false;
    uint32_t probes = 0;
};

// Finds the largest error that keeps the target with the margin.
[[nodiscard]] SearchResult searchSteps(const SearchTask& task);
// Most pictures that a search draws, for the total of the progress.
[[nodiscard]] size_t searchPictures(size_t poses);

} // namespace gsc
