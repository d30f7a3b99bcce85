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

// At least one. `title`, if given, takes the name that a trajectory states, empty if none. Warns where an embedding row
// had to be chosen for a camera and where distortion is ignored. `model` is the scene's file. Throws Error (Usage, Io,
// InvalidFile, Unsupported).
std::vector<Shot> chooseShots(const Scene& scene, const std::string& model, const CameraChoice& choice,
                              const ViewChoice& view, Reporter& log, std::string* title = nullptr);

// Background, near plane, tier, detail, stereo, what is said of levels, and reuse; the appearance is the shot's.
FrameOptions frameOptions(const Scene& scene, const FrameChoice& choice);

} // namespace gsc
