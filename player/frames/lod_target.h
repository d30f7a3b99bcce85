// SPDX-License-Identifier: Apache-2.0
// Checks options that need a model with levels, and makes the guard of --target-ms with the settings that it may
// lower.
#pragma once

#include "player/options/frame_choice.h"
#include "runtime/view/frame_guard.h"
#include <gsc/scene.h>

#include <optional>
#include <string>

namespace gsc {

// Returns true if the model chooses levels by distance: not a Scaffold-GS model, nor one that was trained with a
// single level.
bool hasLevels(const Scene& scene);

// Throws Error(Usage) if `value`, in levels, is not 0 and the model has only one level. `what` names the option, or
// the key and the file that state the value.
void checkLevelChoice(const Scene& scene, const std::string& model, const std::string& what, double value);
// Checks all options in `choice` that concern levels
void checkLevelOptions(const Scene& scene, const std::string& model, const FrameChoice& choice);

// Returns true if frames of `choice` are drawn with detail by `backend`, which draws them in tier `runs`
// (Renderer::tierOf()).
bool drawsDetail(const FrameChoice& choice, const std::string& backend, Tier runs);

// Settings that a time target may lower to make frames cheaper, beside the level bias.
struct Guarded {
    bool detail = false;    // true: the detail may get coarser (see drawsDetail())
    bool periphery = false; // true: the outer parts of --foveation may get coarser
};

// Makes the guard of the time target of `choice`. None without a target, or if no setting can make the frames cheaper.
std::optional<FrameGuard> frameGuard(const Scene& scene, const FrameChoice& choice, Guarded guarded);
// Returns frameGuard(); throws Error(Usage) if there is a target but no setting can make the frames cheaper.
std::optional<FrameGuard> checkedGuard(const Scene& scene, const std::string& model, const FrameChoice& choice,
                                       Guarded guarded);

} // namespace gsc
