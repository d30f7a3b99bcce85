// SPDX-License-Identifier: Apache-2.0
// Finds pictures that a trainer rendered itself, and the cameras that it rendered from.
#pragma once

#include "convert/input/checkpoint.h"
#include <gsc/camera.h>

#include <string>
#include <vector>

namespace gsc {

struct TrainerPicture {
    std::string path; // path of the PNG
    // the caller sets its width and height to those of the picture
    Camera camera;
};

// Pictures NAME.png of a folder whose cameras.json lists exact cameras (R_camera_to_world, T_world_to_camera, FoVx,
// FoVy, width, height, uid). Throws Error (Io, InvalidFile).
std::vector<TrainerPicture> picturesOfGolden(const std::string& folder);

// Pictures of a folder test/ours_<iteration>/renders that a trainer's render.py wrote: NNNNN.png shows test camera
// number NNNNN of `cameras`. Empty if the folder has none.
std::vector<TrainerPicture> picturesOfTest(const std::string& folder, const std::vector<SourceCamera>& cameras);

// Path of <model>/golden if that exists, else of <model>/test/ours_<iteration>/renders; empty if neither exists.
std::string findTrainerPictures(const Checkpoint& checkpoint);

} // namespace gsc
