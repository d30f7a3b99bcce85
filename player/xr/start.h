// SPDX-License-Identifier: Apache-2.0
// Start of a viewer in a model: on the ground, at the first camera, or before the model as a table-top. Small pictures
// tell which of them shows most of the model.
#pragma once

#include "player/poses/placement.h"
#include "runtime/frames/shot.h"

#include <array>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace gsc {

constexpr double kEyeHeight = 1.6; // eyes of a standing viewer, metres above the floor

enum class StartPlace {
    Most,   // the one of the others that shows most of the model
    Camera, // at the first camera, with a level head
    Ground, // standing where the first camera looks, facing the same way
    Table,  // before the whole model, a metre wide
};
constexpr size_t kStartPlaces = 4;

// Depths of the eyes of a shot: rows of a picture each, view z in world units, infinity where more than half of the
// light passes the model. Empty vectors: no picture came.
using EyeDepths = std::array<std::vector<float>, kMaxEyes>;
using DrawDepths = std::function<EyeDepths(const Shot& shot, uint32_t eyes)>;

struct Start {
    StartPlace place = StartPlace::Camera; // never Most
    Placement eyes;                        // a space with the viewer's eyes at its origin
    // share of an eye's pixels that show the model from each start, in the eye that has fewer; none: not measured
    std::optional<double> shown[kStartPlaces] = {};
};

// Chooses the start of a viewer who wants `wanted`, and measures only what the choice needs. `first` is the first
// camera; `up` and `metre` are those of Placement. Where the first camera sees no ground the viewer starts at it.
Start chooseStart(StartPlace wanted, const ModelView& model, const Shot& first, const std::array<double, 3>& up,
                  double metre, const DrawDepths& draw);

const char* startWords(StartPlace place);  // "on the ground"
std::string startText(const Start& start); // a sentence without a full stop: the start, and what was measured

} // namespace gsc
