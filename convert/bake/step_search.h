// SPDX-License-Identifier: Apache-2.0
// Finds the coarsest values that keep a target by varying one number, the error that rounding a value may cost.
#pragma once

#include "convert/bake/model/reduced_model.h"
#include "convert/bake/pictures/picture_probe.h"

#include <cstddef>
#include <cstdint>
#include <functional>

namespace gsc {

// Decibels above the target that the search aims at, so that the poses of the verdict reach the target, too.
constexpr double kSearchMargin = 0.6;

// Scores a model baked as `plan` says, from the poses [first, first + count); poses of the search come first.
using PlanScore = std::function<SetScore(const BakePlan& plan, size_t first, size_t count)>;

struct SearchTask {
    const ModelParams& params;
    uint64_t anchors;
    PlanScore score;
    size_t poses;
    uint64_t weight_pixels; // pixels of the poses that importance was measured from
    uint32_t levers;
    double target = 0, min_view = 0; // dB of all pictures pooled, and least dB of a single view
    double margin = kSearchMargin;   // dB above target and min_view that the search aims at
    const BakePlan* from = nullptr;  // plan of an earlier search to start from; null = none
};

struct SearchResult {
    BakePlan plan;
    SetScore score; // score of `plan` from the poses of the search
    bool kept = false;
    uint32_t probes = 0;
};

// Finds the largest BakePlan::error with which the pictures keep the target and the margin.
[[nodiscard]] SearchResult searchSteps(const SearchTask& task);
// Number of pictures that a search usually draws, for the total of the progress.
[[nodiscard]] size_t searchPictures(size_t poses);

} // namespace gsc
