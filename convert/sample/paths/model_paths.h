// SPDX-License-Identifier: Apache-2.0
// Makes camera paths through any model, at the pace of a viewer of human size.
#pragma once

#include "convert/sample/paths/camera_motions.h"
#include "convert/survey/model_survey.h"

#include <string>
#include <vector>

namespace gsc {

struct ModelPath {
    CameraPath path;
    // share, 0 to 1, of the well-seen anchors that are in view, in the frame where it is smallest
    double least_share = 0;
    double top_speed = 0; // largest speed between two frames in metres per second, without jumps of a teleport
};

// Names of all paths, in the order in which they are made.
const std::vector<std::string>& modelPathNames();

// Makes the paths walk, ascent, zoom_out, orbit, head_turn, jitter, teleport, walk_through, level_swing, wide_eyes,
// stroll, look_around, and aerial and flight unless the cameras stand on the ground. `fps`: frames per second; 0 =
// kLiveRate for flight, stroll and look_around, kHeadsetRate for the others. `only`: names of the wanted paths; empty =
// all. Throws Error: Usage if this model cannot have a wanted path; Interrupted.
std::vector<ModelPath> modelPaths(const ModelSurvey& survey, const PathLens& lens, double fps,
                                  const std::vector<std::string>& only);

} // namespace gsc
