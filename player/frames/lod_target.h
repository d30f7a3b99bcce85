// SPDX-License-Identifier: Apache-2.0
// What is asked of a model's levels, whether there are levels at all, and what --target-ms may take of frames.
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

// What a target may take of frames beside levels.
struct Guarded {
    bool detail = false;    // drawsDetail()
    bool periphery = false; // of --foveation
};

// None without a target, or where there is nothing to take.
std::optional<FrameGuard> frameGuard(const Scene& scene, const FrameChoice& choice, Guarded guarded);
// The same; throws Error(Usage) where there is nothing to take.
std::optional<FrameGuard> checkedGuard(const Scene& scene, const std::string& model, const FrameChoice& choice,
                                       Guarded guarded);

} // namespace gsc
