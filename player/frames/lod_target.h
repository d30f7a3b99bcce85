// SPDX-License-Identifier: Apache-2.0
// Checks of options that need a model with levels, and the guard of --target-ms with the settings that it may lower.
#pragma once

#include "player/options/frame_choice.h"
#include "runtime/view/frame_guard.h"
#include <gsc/scene.h>

#include <optional>
#include <string>

namespace gsc {

// True if the model has a rule for levels: not a Scaffold-GS model, nor one that was trained with a single level.
bool hasLevels(const Scene& scene);

// Throws Error(Usage) if `value`, in levels, is not 0 and the model has only one level. `what`: the option, or the key
// of a file with the file's name.
void checkLevelChoice(const Scene& scene, const std::string& model, const std::string& what, double value);
// checks all options of a choice that concern levels
void checkLevelOptions(const Scene& scene, const std::string& model, const FrameChoice& choice);

// True if a backend that draws in tier `runs` (Renderer::tierOf()) can draw frames of the choice with detail.
bool drawsDetail(const FrameChoice& choice, const std::string& backend, Tier runs);

// Means that a time target may use beside levels to make frames cheaper.
struct Guarded {
    bool detail = false;    // drawsDetail()
    bool periphery = false; // the periphery of --foveation may get coarser
};

// Guard of the choice's time target; none without a target, or where frames have nothing to give up.
std::optional<FrameGuard> frameGuard(const Scene& scene, const FrameChoice& choice, Guarded guarded);
// Returns frameGuard(); throws Error(Usage) if there is a target and frames have nothing to give up.
std::optional<FrameGuard> checkedGuard(const Scene& scene, const std::string& model, const FrameChoice& choice,
                                       Guarded guarded);

} // namespace gsc
