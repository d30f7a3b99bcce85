// SPDX-License-Identifier: Apache-2.0
// Checks of options that need a model with levels, and the guard of --target-ms with what it may take from frames.
#pragma once

#include "player/options/frame_choice.h"
#include "runtime/view/frame_guard.h"
#include <gsc/scene.h>

#include <optional>
#include <string>

namespace gsc {

// Does a rule choose between levels? Not in a Scaffold-GS model, nor in one that was trained with a single level.
bool hasLevels(const Scene& scene);

// Throws Error(Usage) where `value`, in levels, is asked of the levels of a model that has one. `what` is the option or
// the key of a file, with its file; 0 asks for nothing.
void checkLevelChoice(const Scene& scene, const std::string& model, const std::string& what, double value);
void checkLevelOptions(const Scene& scene, const std::string& model, const FrameChoice& choice); // all of a choice's

// Can frames of the choice be drawn with detail by a backend that draws them in tier `runs` (Renderer::tierOf())?
bool drawsDetail(const FrameChoice& choice, const std::string& backend, Tier runs);

// Means that a time target may use beside levels to make frames cheaper.
struct Guarded {
    bool detail = false;    // drawsDetail()
    bool periphery = false; // of --foveation
};

// Guard of the choice's time target; none without a target, or where frames have nothing to give up.
std::optional<FrameGuard> frameGuard(const Scene& scene, const FrameChoice& choice, Guarded guarded);
// As frameGuard(); throws Error(Usage) where there is a target and frames have nothing to give up.
std::optional<FrameGuard> checkedGuard(const Scene& scene, const std::string& model, const FrameChoice& choice,
                                       Guarded guarded);

} // namespace gsc
