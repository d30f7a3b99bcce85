// SPDX-License-Identifier: Apache-2.0
// Chooses the shots of a run: cameras, rows of the appearance embedding, and frame options, from the command line and
// the file.
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
    std::string title;        // title stated in the trajectory; empty = none
    std::string no_path;      // reason why the shots are no path, as the end of a message; empty = they are a path
    double fps = kDefaultFps; // frames per second that were asked for, or that the trajectory states
};

// Reads the cameras; returns at least one shot. Warns if a row of the appearance embedding had to be chosen for a
// camera, and if distortion is ignored. `model` is the path of the scene's file. Throws Error (Usage, Io, InvalidFile,
// Unsupported).
std::vector<Shot> chooseShots(const Scene& scene, const std::string& model, const CameraChoice& choice,
                              const ViewChoice& view, Reporter& log, ShotFacts* facts = nullptr);

// Returns `choice` for shots with this ShotFacts::no_path: detail is switched off, with a warning, if they are no
// path.
FrameChoice choiceOn(const std::string& no_path, const FrameChoice& choice, Reporter& log);

// Sets background, near plane, tier, detail, stereo, levels and reuse; the shot itself sets the appearance.
FrameOptions frameOptions(const Scene& scene, const FrameChoice& choice);

} // namespace gsc
