// SPDX-License-Identifier: Apache-2.0
// The poses of a trajectory.
#pragma once

#include "player/frames/shots.h"

#include <string>
#include <vector>

namespace gsc {

// Poses of one trajectory, with the name for reports.
struct Path {
    std::string name;    // name stated in the trajectory, else the file name without its extension
    std::string cameras; // camera file, as the caller named it
    std::vector<Shot> shots;
    uint32_t eye_count = 1;
    std::string no_path; // reason why the shots are no path (ShotFacts::no_path); empty: they are one
};

// Reads a trajectory. `listed` is the name of the cameras in reports. Throws as chooseShots() does.
Path openPath(const Scene& scene, const std::string& model, const CameraChoice& choice, const ViewChoice& view,
              const std::string& listed, Reporter& log);

} // namespace gsc
