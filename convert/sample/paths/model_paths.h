// SPDX-License-Identifier: Apache-2.0
// Camera paths through any model, at the pace of a viewer of human size.
#pragma once

#include "convert/sample/paths/camera_motions.h"
#include "convert/survey/model_survey.h"

#include <string>
#include <vector>

namespace gsc {

struct ModelPath {
    CameraPath path;
    double least_share = 0; // share of the well-seen anchors in the frame that shows fewest
    double top_speed = 0;   // metres per second between two frames, teleports left out
};

// Names of the paths, in the order they are made.
const std::vector<std::string>& modelPathNames();

// walk, ascent, zoom_out, orbit, head_turn, jitter, teleport, walk_through, level_swing, wide_eyes, stroll, look_around,
// and aerial and flight unless the cameras stand on the ground. `fps` 0: kLiveRate for flight, stroll and look_around,
// kHeadsetRate for the others. `only` names those wanted, empty = all. Throws Error (Usage: one was asked for that this
// model has not; Interrupted).
std::vector<ModelPath> modelPaths(const ModelSurvey& survey, const PathLens& lens, double fps,
                                  const std::vector<std::string>& only);

} // namespace gsc
