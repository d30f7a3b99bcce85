// SPDX-License-Identifier: Apache-2.0
// What is asked of a model's levels: --target-ms, and whether there are levels at all.
#pragma once

#include "player/options/frame_choice.h"
#include "runtime/view/lod_control.h"
#include <gsc/scene.h>

#include <optional>
#include <string>

namespace gsc {

// Does a rule choose between levels? Not in a Scaffold-GS model, nor in one that was trained with a single level.
bool hasLevels(const Scene& scene);

// Throws Error(Usage) where `value`, in levels or milliseconds, is asked of the levels of a model that has one. `what`
// is the option or the key of a file, with its file; 0 asks for nothing.
void checkLevelChoice(const Scene& scene, const std::string& model, const std::string& what, double value);
// All of a choice's; the target too where levels are what holds it.
void checkLevelOptions(const Scene& scene, const std::string& model, const FrameChoice& choice,
                       bool levels_hold_target = true);

// How far a target may let the bias fall.
double coarsestBias(const Scene& scene, const FrameChoice& choice);

// What gives each frame its bias; none without a target. Precondition: checkLevelOptions() passed.
std::optional<LodControl> lodControl(const Scene& scene, const FrameChoice& choice);

} // namespace gsc
