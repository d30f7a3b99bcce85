// SPDX-License-Identifier: Apache-2.0
// The poses of a trajectory.
#pragma once

#include "player/frames/shots.h"

#include <string>
#include <vector>

namespace gsc {

// The poses of one trajectory, as a run asks for them.
struct Path {
    std::string name;    // stated by the trajectory, else the file name without its extension
    std::string cameras; // as the caller named it
    std::vector<Shot> shots;
    uint32_t eye_count = 1;
    std::string no_path; // ShotFacts::no_path
};

// `listed`: name of the cameras in reports. Throws as chooseShots().
Path openPath(const Scene& scene, const std::string& model, const CameraChoice& choice, const ViewChoice& view,
              const std::string& listed, Reporter& log);

} // namespace gsc
