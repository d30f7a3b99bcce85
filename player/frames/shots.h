// SPDX-License-Identifier: Apache-2.0
// Shots of a run: cameras, embedding rows and frame options, chosen by the command line and the file.
#pragma once

#include "player/options/camera_choice.h"
#include "player/options/frame_choice.h"
#include "runtime/cli/reporter.h"
#include "runtime/frames/shot.h"
#include <gsc/scene.h>

#include <string>
#include <vector>

namespace gsc {

struct ShotFacts {
    std::string title;   // stated by the trajectory; empty = none
    std::string no_path; // why the shots are no path, as a message says it; empty = they are one
};

// At least one. Warns where an embedding row had to be chosen for a camera and where distortion is ignored. `model` is the
// scene's file. Throws Error (Usage, Io, InvalidFile, Unsupported).
std::vector<Shot> chooseShots(const Scene& scene, const std::string& model, const CameraChoice& choice,
                              const ViewChoice& view, Reporter& log, ShotFacts* facts = nullptr);

// The choice as shots are drawn that ShotFacts::no_path is of: without detail where they are no path, which `log` is warned
// of.
FrameChoice choiceOn(const std::string& no_path, const FrameChoice& choice, Reporter& log);

// Sets background, near plane, tier, detail, stereo, levels and reuse; the appearance is the shot's.
FrameOptions frameOptions(const Scene& scene, const FrameChoice& choice);

} // namespace gsc
